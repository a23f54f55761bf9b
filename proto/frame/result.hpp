// Result<T>: how cold code reports failure. A failure is one sentence that states what to do, with
// the file and line if there is one. Hot code never uses it (see Outcome in sink.hpp).
#pragma once

#include <cerrno>
#include <expected>
#include <string>
#include <type_traits>
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

// A value or the error that came instead of it. It is a class of its own so that the compiler
// refuses every call whose result nobody looks at.
template <typename T = void>
class [[nodiscard]] Result : public std::expected<T, Error> {
 public:
  using std::expected<T, Error>::expected;
};

// TRY(expression) is the value of a Result. If the Result holds an error, the function that
// contains the TRY returns this error at once. Of a Result<> there is no value: TRY(...) is then a
// statement. Write it only as a whole statement, or as the whole of what a variable is initialised
// with or assigned, never as a part of an expression: gcc 12 does not destroy the temporaries of
// the rest of the expression when the function returns from the middle of it.
#define TRY(...) POSED_TRY_AS(POSED_TRY_JOIN(try_result_, __COUNTER__), __VA_ARGS__)
#define POSED_TRY_JOIN(a, b) POSED_TRY_JOIN_NOW(a, b)
#define POSED_TRY_JOIN_NOW(a, b) a##b
#define POSED_TRY_AS(name, ...)                                             \
  __extension__({                                                           \
    auto name = (__VA_ARGS__);                                              \
    if (!name.has_value()) return std::unexpected(std::move(name).error()); \
    ::posed::moved_value(std::move(name));                                  \
  })

// Moves the value out of a Result that has one.
template <typename T>
T moved_value(Result<T>&& result) {
  if constexpr (!std::is_void_v<T>) return *std::move(result);
}

// What the system says of an error number. Any thread.
[[nodiscard]] std::string errno_text(int error = errno);

// return fail("..."), return fail("...", path, line)
[[nodiscard]] inline std::unexpected<Error> fail(std::string message, std::string file = {},
                                                 int line = 0) {
  return std::unexpected(Error{std::move(message), std::move(file), line, ExitCode::kFailed});
}

// The same for a mistake in how the program was called or configured (exit code 2).
[[nodiscard]] inline std::unexpected<Error> misuse(std::string message, std::string file = {},
                                                   int line = 0) {
  return std::unexpected(Error{std::move(message), std::move(file), line, ExitCode::kWrongUse});
}

}  // namespace posed
