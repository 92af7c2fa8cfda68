#pragma once
#include <sstream>
#include <stdexcept>
#include <string>

namespace fv {

/// An argument that cannot be used; the text names the value and what would be valid. Nothing was changed.
class InputError : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

/// A sensor that stands where an octree of the map's resolution has no voxels; the text says how far to shift
/// it.
class OutsideKeysError : public InputError {
 public:
  using InputError::InputError;
};

/// A map file that is truncated, foreign or cannot be opened; the text names the file.
class MapFileError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Throw InputError with "<name> is <value>; valid: <valid>" unless `ok`.
template <class T>
void require(bool ok, const char* name, const T& value, const char* valid) {
  if (ok) return;
  std::ostringstream text;
  text << name << " is " << value << "; valid: " << valid;
  throw InputError(text.str());
}

}  // namespace fv
