// Result<T>: how cold code reports failure. A failure is one sentence that states what to do, with
// the file and line if there is one. Hot code never uses it (see Outcome in sink.hpp).
#pragma once

#include <cerrno>
#include <expected>
#include <string>
#include <utility>

namespace posed {

// The exit code a command ends with. Clients may rely on the numbers.
enum class ExitCode : int { kDone = 0, kFailed = 1, kWrongUse = 2 };

struct Error {
  std::string message;  // one sentence that states what to do; no trailing newline
  std::string file;     // empty when the error concerns no file
  int line = 0;         // 1-based; 0 when the error concerns no line
  ExitCode exit_code = ExitCode::kFailed;

  // "file:line: message", without the parts that are not known.
  [[nodiscard]] std::string text() const;
};

template <typename T = void>
using Result = std::expected<T, Error>;

// The system's text for an error number. Any thread.
[[nodiscard]] std::string errno_text(int error = errno);

// return fail("..."), return fail("...", path, line)
[[nodiscard]] inline std::unexpected<Error> fail(std::string message, std::string file = {},
                                                 int line = 0) {
  return std::unexpected(Error{std::move(message), std::move(file), line, ExitCode::kFailed});
}

// As fail(), for a mistake in how the program was called or configured (exit code 2).
[[nodiscard]] inline std::unexpected<Error> misuse(std::string message, std::string file = {},
                                                   int line = 0) {
  return std::unexpected(Error{std::move(message), std::move(file), line, ExitCode::kWrongUse});
}

}  // namespace posed
