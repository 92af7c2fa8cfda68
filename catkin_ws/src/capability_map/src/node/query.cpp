// Answers views from the command line, without Python or ROS: an example of the C++ interface.

#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "capability_map/map_file.h"
#include "fv_common/last_resort.h"

namespace {

constexpr char kUsage[] =
    "usage: query MAP [--nearest] < VIEWS\n"
    "VIEWS: one view a line, x y z dx dy dz: tip position [m] and viewing direction, of any length but 0, in "
    "the\n"
    "map's base frame.\n"
    "Prints a line for each: the answer 0..1, yes or no (reachable), yes or no (covered by the fitted shapes "
    "alone),\n"
    "and the joint values of the nearest stored point [rad or m], none where the view's sphere is empty. "
    "Empty lines\n"
    "and those that begin with # are repeated as they are, so that lines keep their numbers. The first line "
    "that is\n"
    "no view ends it with exit code 1.\n"
    "  --nearest   the bit of the nearest stored view, 0 or 1, instead of a weighted answer\n";
constexpr size_t kLongestLine = 4096;
constexpr int kCutOff = 128 + SIGPIPE;  // what a shell says when nobody reads the output any more
constexpr char kBlank[] = " \t\r\v\f";

using View = std::array<double, 6>;

/// What a user can read of any bytes.
std::string shown(std::string_view text) {
  constexpr size_t kMost = 40;
  std::string out;
  for (const char c : text.substr(0, kMost)) out += c >= ' ' && c <= '~' ? c : '?';
  return "'" + out + (text.size() > kMost ? "...'" : "'");
}

/// The next line without its end. @return False at the end of the input.
/// @throws std::runtime_error when it is too long, or cannot be read.
bool readLine(std::string& line) {
  line.clear();
  int c = std::getc(stdin);
  for (; c != EOF && c != '\n'; c = std::getc(stdin)) {
    if (line.size() == kLongestLine) {
      throw std::runtime_error("is longer than " + std::to_string(kLongestLine) + " characters");
    }
    line += static_cast<char>(c);
  }
  if (std::ferror(stdin) != 0)
    throw std::runtime_error(std::string("cannot be read: ") + std::strerror(errno));
  return c != EOF || !line.empty();
}

std::vector<std::string_view> wordsOf(std::string_view line) {
  std::vector<std::string_view> words;
  for (size_t at = line.find_first_not_of(kBlank); at != std::string_view::npos;) {
    const size_t end = std::min(line.find_first_of(kBlank, at), line.size());
    words.push_back(line.substr(at, end - at));
    at = line.find_first_not_of(kBlank, end);
  }
  return words;
}

/// @throws std::runtime_error unless the word is one finite number, in the C locale whatever that of the user
/// is.
double numberOf(std::string_view word) {
  const bool plus = word.size() > 1 && word[0] == '+' && word[1] != '-';
  double value = 0.0;
  const char* const end = word.data() + word.size();
  const auto [rest, error] = std::from_chars(word.data() + (plus ? 1 : 0), end, value);
  if (error != std::errc() || rest != end || !std::isfinite(value)) {
    throw std::runtime_error(shown(word) + " is no finite number of 64 bits");
  }
  return value;
}

/// @throws std::runtime_error unless the line holds six finite numbers.
View viewOf(std::string_view line) {
  const std::vector<std::string_view> words = wordsOf(line);
  View view{};
  for (size_t i = 0; i < std::min(words.size(), view.size()); ++i) view[i] = numberOf(words[i]);
  if (words.size() != view.size()) {
    throw std::runtime_error(shown(line) + " has " + std::to_string(words.size()) +
                             (words.size() == 1 ? " number" : " numbers") + "; valid: six, x y z dx dy dz");
  }
  return view;
}

/// Prints the answers to one view.
class Answers {
 public:
  Answers(const capability_map::MapFile& map, bool interpolate)
      : map_(map),
        query_(map.query()),
        seeds_(map.seeds()),
        interpolate_(interpolate),
        q_(static_cast<size_t>(map.joint_limits.rows())) {}

  /// @throws std::invalid_argument where the view has no direction.
  void print(const View& view) {
    const Eigen::Vector3d p(view[0], view[1], view[2]);
    const Eigen::Vector3d d(view[3], view[4], view[5]);
    const float value = interpolate_ ? query_.interpolated(p, d) : query_.nearest(p, d);
    std::cout << value << (value >= map_.threshold ? " yes" : " no") << (map_.covered(p, d) ? " yes" : " no");
    const capability_map::SeedLookup::Seed seed = seeds_.nearest(p, d);
    if (seed.point >= 0) {
      map_.witness(seed.point, q_.data());
      for (const double joint : q_) std::cout << ' ' << joint;
    }
    std::cout << '\n';
  }

 private:
  const capability_map::MapFile& map_;
  capability_map::CapabilityQuery query_;
  capability_map::SeedLookup seeds_;
  bool interpolate_;
  std::vector<double> q_;
};

/// Answers line by line until the input ends or the output cannot be written.
/// @return 0, or the errno of the output.
/// @throws std::runtime_error naming the first line that is no view; the answers before it have been printed.
int answerLines(Answers answers) {
  std::string line;
  for (int64_t number = 1;; ++number) {
    try {
      if (!readLine(line)) return 0;
      const size_t first = line.find_first_not_of(kBlank);
      if (first == std::string::npos || line[first] == '#') {
        std::cout << line << '\n';
      } else {
        answers.print(viewOf(line));
      }
    } catch (const std::exception& error) {
      throw std::runtime_error("line " + std::to_string(number) + ": " + error.what());
    }
    if (!std::cout.flush()) return errno;  // at each line: who asks may wait for the answer
  }
}

int run(const std::string& path, bool interpolate) {
  std::cout.precision(9);
  const capability_map::MapFile map = capability_map::loadMapFile(path);
  const int error = answerLines(Answers(map, interpolate));
  if (error == 0) return 0;
  if (error == EPIPE) return kCutOff;
  throw std::runtime_error(std::string("the answers cannot be written: ") + std::strerror(error));
}

}  // namespace

int main(int argc, char** argv) {
  fv_common::endInOneLine();
  std::signal(SIGPIPE, SIG_IGN);  // seen at the stream instead
  const std::vector<std::string> words(argv + 1, argv + argc);
  const bool nearest = words.size() == 2 && words[1] == "--nearest";
  if (!words.empty() && (words[0] == "--help" || words[0] == "-h")) {
    std::cout << kUsage;
    return 0;
  }
  if (words.size() != 1 && !nearest) {
    std::cerr << "query: valid: MAP, or MAP --nearest; --help says more\n";
    return 2;
  }
  try {
    return run(words[0], !nearest);
  } catch (const std::exception& error) {
    std::cerr << "query: " << error.what() << '\n';
    return 1;
  }
}
