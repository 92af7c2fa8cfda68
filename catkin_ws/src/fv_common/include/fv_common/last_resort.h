/// The last resort of C++ programs: no exception ends them by a signal.
#pragma once

#include <errno.h>

#include <cstdlib>
#include <exception>
#include <iostream>

namespace fv_common {

/// From now on an exception that nobody catches, in whatever thread, ends the process with one line on stderr
/// and exit code 70 (EX_SOFTWARE), not by SIGABRT. Destructors do not run.
inline void endInOneLine() {
  std::set_terminate([] {
    try {
      if (const std::exception_ptr error = std::current_exception()) std::rethrow_exception(error);
      std::cerr << program_invocation_short_name << ": ended by std::terminate" << std::endl;
    } catch (const std::exception& error) {
      std::cerr << program_invocation_short_name << ": unexpected error: " << error.what() << std::endl;
    } catch (...) {
      std::cerr << program_invocation_short_name << ": unexpected error of unknown kind" << std::endl;
    }
    std::_Exit(70);
  });
}

}  // namespace fv_common
