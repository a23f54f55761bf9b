#include "daemon/system/last_words.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <new>
#include <system_error>

#include <execinfo.h>
#include <unistd.h>

namespace posed::system {
namespace {

// Without the heap, which may be what is missing.
void say_last(const char* why, const char* cure) {
  std::array<char, 512> text{};
  const int size = std::snprintf(text.data(), text.size(), "posed: %s; %s\n", why, cure);
  const auto bytes = std::min(static_cast<std::size_t>(std::max(size, 0)), text.size() - 1);
  static_cast<void>(!::write(STDERR_FILENO, text.data(), bytes));
}

[[noreturn]] void end_now() noexcept {
  const auto thrown = std::current_exception();
  if (!thrown) std::abort();  // a mistake in posed, for a debugger
  try {
    std::rethrow_exception(thrown);
  } catch (const std::bad_alloc&) {
    say_last("there is not enough memory",
             "allow more (ulimit -v, MemoryMax) or give it less to do");
  } catch (const std::system_error& error) {
    if (error.code() == std::errc::resource_unavailable_try_again) {
      say_last("no more threads may begin",
               "allow more (ulimit -u, TasksMax) or memory (ulimit -v)");
    } else {
      say_last(error.what(), "posed cannot go on");
    }
  } catch (const std::exception& error) {
    say_last(error.what(), "this is a fault of posed; please report it");
  } catch (...) {
    say_last("something of no known kind was thrown", "this is a fault of posed; please report it");
  }
  ::_exit(1);
}

}  // namespace

void end_with_a_sentence() {
  std::set_terminate(end_now);
  // The C library loads what it unwinds with at the first use, and aborts where there is no memory
  // left for that; so it is used once now.
  void* here = nullptr;
  static_cast<void>(::backtrace(&here, 1));
}

}  // namespace posed::system
