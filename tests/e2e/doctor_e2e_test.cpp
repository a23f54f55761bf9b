// `posed doctor` on this machine, whatever it is like.
#include <catch2/catch.hpp>

#include <string>

#include <nlohmann/json.hpp>

#include "tests/e2e/outcome.hpp"
#include "tests/e2e/served.hpp"

namespace posed::test {
namespace {

using nlohmann::json;

// The check of this name in what `posed doctor --json` printed.
json doctor_check(const std::string& printed, const std::string& name) {
  const json all = json::parse(printed);
  for (const json& check : all.at("checks")) {
    if (check.at("name") == name) return check;
  }
  FAIL("no check " << name);
  return {};
}

TEST_CASE("doctor's exit code agrees with its checks, and each that fails has a cure") {
  const auto doctor = posed({"doctor", "--json"});
  INFO(doctor.out << doctor.err);
  const json all = json::parse(doctor.out);
  bool ok = true;
  for (const json& check : all.at("checks")) {
    ok = ok && check.at("ok").get<bool>();
    CHECK(check.at("fix").get<std::string>().empty() == check.at("ok").get<bool>());
    CHECK_FALSE(check.at("found").get<std::string>().empty());
  }
  CHECK(all.at("ok") == ok);
  CHECK(doctor.code == (ok ? 0 : 1));
  CHECK(doctor_check(doctor.out, "ports").at("ok") == true);

  const auto people = posed({"doctor"});
  CHECK(people.code == doctor.code);
  CHECK(has(people.out, "clock source"));
  CHECK_FALSE(has(people.out, "\x1b["));  // no terminal, no colours
  CHECK(has(people.out, "-      disk                    not looked at: give --config FILE\n"));
  CHECK_FALSE(has(people.out, "of 15 "));
}

TEST_CASE("doctor finds the ports of a config in use while a daemon runs, and free afterwards") {
  Served served;
  served.start();
  Stage second;
  second.folder.write("posed.toml", "[publish]\nendpoint = \"" + served.publish +
                                        "\"\n[control]\nendpoint = \"tcp://127.0.0.1:*\"\n" +
                                        Stage::kWalker);
  const std::vector<std::string> command{"doctor", "--json", "--config", second.path("posed.toml")};
  const auto busy = posed(command);
  CHECK(busy.code == 1);
  INFO(busy.out << busy.err);
  const json ports = doctor_check(busy.out, "ports");
  CHECK(ports.at("ok") == false);
  CHECK(has(ports.at("found"), served.publish.substr(6)));
  served.daemon->send(SIGINT);
  CHECK(served.daemon->exit_code() == 0);
  CHECK(doctor_check(posed(command).out, "ports").at("ok") == true);
}

TEST_CASE("doctor refuses wrong use with exit code 2") {
  const Stage stage;
  stage.folder.write("posed.toml", "nonsense = 1\n");
  CHECK(posed({"doctor", "--config", stage.path("posed.toml")}).code == 2);
  CHECK(posed({"doctor", "--nonsense"}).code == 2);
  CHECK(has(posed({"doctor", "--help"}).out, "posed doctor --config mine.toml"));
  CHECK(has(posed({"completion", "bash"}).out, " doctor "));
}

}  // namespace
}  // namespace posed::test
