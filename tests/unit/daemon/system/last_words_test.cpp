// What is left of a process that an exception ends.
#include "daemon/system/last_words.hpp"

#include <functional>
#include <new>
#include <stdexcept>
#include <string>
#include <system_error>

#include <catch2/catch.hpp>

#include <sys/wait.h>
#include <unistd.h>

using namespace posed;

namespace {

struct End {
  int status = 0;  // of waitpid()
  std::string words;
};

// How a process ends in which `work` throws where nobody catches it.
End end_of(const std::function<void()>& work) {
  int out[2];
  REQUIRE(::pipe(out) == 0);
  const pid_t child = ::fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    ::dup2(out[1], STDERR_FILENO);
    system::end_with_a_sentence();
    [&]() noexcept { work(); }();
    ::_exit(0);
  }
  ::close(out[1]);
  End end;
  char letter = 0;
  while (::read(out[0], &letter, 1) == 1) end.words += letter;
  ::close(out[0]);
  ::waitpid(child, &end.status, 0);
  return end;
}

}  // namespace

TEST_CASE("an exception that nobody catches is one sentence and exit code 1", "[system]") {
  const auto check = [](const std::string& words, const std::function<void()>& work) {
    const End end = end_of(work);
    CHECK(WIFEXITED(end.status));
    CHECK(WEXITSTATUS(end.status) == 1);
    CHECK(end.words.starts_with("posed: "));
    CHECK(end.words.find(words) != std::string::npos);
    CHECK(end.words.find('\n') == end.words.size() - 1);
  };
  check("no more threads may begin; allow more", [] {
    throw std::system_error(std::make_error_code(std::errc::resource_unavailable_try_again));
  });
  check("not enough memory", [] { throw std::bad_alloc(); });
  check("out of nowhere; this is a fault of posed",
        [] { throw std::logic_error("out of nowhere"); });
  check("of no known kind", [] { throw 1; });
}
