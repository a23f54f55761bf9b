// The C++ client's example with the real daemon.
#include <catch2/catch.hpp>

#include <cstdio>
#include <memory>

#include "tests/e2e/printed_places.hpp"
#include "tests/e2e/served.hpp"
#include "tests/support/shared.hpp"

namespace posed::test {

TEST_CASE("the C++ client's joints are those of the clip that plays") {
  Served served;
  served.start();
  const auto watch = posed_binary().parent_path() / "posed_client_watch";
  const std::string command =
      "timeout 60 '" + watch.string() + "' " + served.publish + " walker-raw 1 2>&1";
  const std::unique_ptr<FILE, int (*)(FILE*)> client(popen(command.c_str(), "r"), pclose);
  REQUIRE(client);
  std::string said;
  for (char line[512]; std::fgets(line, sizeof line, client.get()) != nullptr;) said += line;
  INFO(said);
  const Places shown = printed_places(said);
  CHECK(nearest_m(shown, served.folder.path() / "walk.bvh", false) < 2e-6);  // six decimals
}

}  // namespace posed::test
