// Runs the client from the top README, unchanged, with a running daemon.
#include <cstdio>
#include <fstream>
#include <iterator>
#include <memory>

#include "tests/e2e/served.hpp"
#include "tests/support/shared.hpp"

namespace posed::test {
namespace {

void replace(std::string& text, const std::string& what, const std::string& by) {
  const auto at = text.find(what);
  REQUIRE(at != std::string::npos);
  text.replace(at, what.size(), by);
}

TEST_CASE("the README's Python client receives poses") {
  std::ifstream readme(source_dir() / "README.md");
  const std::string text{std::istreambuf_iterator<char>(readme), {}};
  const std::string fence = "```python\n";
  const auto begin = text.find(fence);
  REQUIRE(begin != std::string::npos);
  std::string code = text.substr(begin + fence.size(),
                                 text.find("```", begin + fence.size()) - begin - fence.size());

  Served served;
  served.start();
  replace(code, "tcp://127.0.0.1:5570", served.publish);
  replace(code, "build/python", (posed_binary().parent_path() / "python").string());
  served.folder.write("client.py", code);
  // Debian's own python3 has the zmq and protobuf packages that `run` installs.
  const std::string command =
      "timeout 60 /usr/bin/python3 -u " + served.path("client.py") + " 2>&1 | head -n 4";
  const std::unique_ptr<FILE, int (*)(FILE*)> client(popen(command.c_str(), "r"), pclose);
  REQUIRE(client);
  std::string said;
  for (char line[512]; std::fgets(line, sizeof line, client.get()) != nullptr;) said += line;
  CHECK(has(said, "pose/walker "));
  CHECK(has(said, "pose/walker-raw "));
}

}  // namespace
}  // namespace posed::test
