// Gate, warm-up and auto-alpha of a live stream: events tell what happens, and the log replays to
// the same bits, whatever was changed on the way.
#include <catch2/catch.hpp>

#include <filesystem>
#include <map>
#include <string>

#include <nlohmann/json.hpp>

#include "tests/e2e/outcome.hpp"
#include "tests/e2e/served.hpp"

namespace posed::test {
using namespace std::chrono_literals;

TEST_CASE("a warm-up, the gate and auto-alpha are told of and replayed") {
  Served served;
  REQUIRE(style::save_model(gated_toy_model(1), served.folder.path() / "gated.style"));
  REQUIRE(style::save_model(gated_toy_model(2), served.folder.path() / "other.style"));
  served.folder.write("posed.toml", std::string(Stage::kEndpoints) + Stage::kWalker +
                                        "[stream.style]\nmodel = \"gated.style\"\n"
                                        "warm_up_s = 2.0\nauto_alpha = true\n");
  served.record();
  CHECK(served.daemon->comes_to_say("walker: ... warm-up is over"));
  CHECK(served.ctl({"set", "walker", "alpha", "0.6"}).code == 0);
  CHECK(served.ctl({"set", "walker", "gate", "false"}).code == 0);
  CHECK(served.ctl({"warm-up", "walker", "--seconds", "2"}).code == 0);
  CHECK(served.ctl({"set", "walker", "auto_alpha", "false"}).code == 0);
  CHECK(served.ctl({"set", "walker", "gate", "true"}).code == 0);
  CHECK(served.ctl({"model", "walker", served.path("other.style")}).code == 0);
  CHECK(served.daemon->comes_to_say("walker: ... interrupted"));
  CHECK(served.ctl({"warm-up", "walker", "--seconds", "0.5"}).code == 1);
  // A model without gate data: what is asked of it in vain is told.
  CHECK(served.ctl({"model", "walker", served.path("one.style")}).code == 0);
  CHECK(served.daemon->comes_to_say("no data ... gate, warm-up and auto-alpha"));
  const auto refused = served.ctl({"warm-up", "walker"});
  CHECK(refused.code == 1);
  CHECK(has(refused.err, "train it again"));
  served.daemon->send(SIGTERM);
  REQUIRE(served.daemon->exit_code() == 0);
  served.check_replay();
}

TEST_CASE("a performer is known from a clip of another day, also in a replay without the clip") {
  Served served;
  REQUIRE(style::save_model(gated_toy_model(1), served.folder.path() / "gated.style"));
  REQUIRE(clip::write_bvh(toy_walk(600), served.folder.path() / "ann.bvh"));
  const std::string style = "[stream.style]\nmodel = \"gated.style\"\nneutral = ";
  const auto config = [&](const std::string& clip) {
    return std::string(Stage::kEndpoints) + Stage::kWalker + style + "\"" + clip + "\"\n";
  };
  served.folder.write("posed.toml", config("nobody.bvh"));
  const auto missing = posed({"check", "--config", served.path("posed.toml")});
  CHECK(missing.code != 0);
  CHECK(has(missing.err + missing.out, "nobody.bvh"));
  served.folder.write("posed.toml", config("ann.bvh"));
  served.record();
  served.await_frames("walker", 60);
  CHECK(served.ctl({"set", "walker", "alpha", "0.6"}).code == 0);
  served.daemon->send(SIGTERM);
  REQUIRE(served.daemon->exit_code() == 0);
  std::filesystem::remove(served.path("ann.bvh"));
  served.check_replay();
}

TEST_CASE("ctl lists the daemon's own models and uses one by name; stats tell weights and mask") {
  Served served("models = \"models\"\n");  // of [control], which stands before
  std::filesystem::create_directory(served.path("models"));
  REQUIRE(style::save_model(toy_styles({1, 2}), served.path("models/both.style")));
  served.start();
  CHECK(has(served.ctl({"models"}).out, "style      both.style"));
  const auto refused = served.ctl({"use-model", "walker", "../one.style"});
  CHECK(refused.code == 1);
  CHECK(has(refused.err, "'../one.style'"));
  CHECK(served.ctl({"use-model", "walker", "both.style"}).code == 0);
  CHECK(served.ctl({"set", "walker", "weights", "s1=0.25,s2=0.75"}).code == 0);
  CHECK(served.ctl({"set", "walker", "mask", "arms=0.5"}).code == 0);
  const auto status = nlohmann::json::parse(served.ctl({"--json", "status"}).out);
  const auto& stage = status["status"]["stream"][0]["stage"][0];
  CHECK(stage["model"] == "both.style");
  CHECK(stage["word"] == nlohmann::json({"s1", "s2"}));
  std::map<std::string, std::string> texts;
  for (const auto& parameter : stage["parameter"]) {
    texts[parameter["name"]] = parameter.value("text", "");
  }
  CHECK(texts["weights"] == "s1=0.25,s2=0.75");
  CHECK(texts["mask"] == "arms=0.5");
  CHECK(has(served.ctl({"status"}).out, "style.weights s1=0.25,s2=0.75, style.mask arms=0.5"));
}

TEST_CASE("a style is taken off live and put on again, and replays; off, it may be deleted") {
  Served served("models = \"models\"\n");
  std::filesystem::create_directory(served.path("models"));
  REQUIRE(style::save_model(toy_model(2, 0.3), served.path("models/only.style")));
  served.record();
  CHECK(served.ctl({"use-model", "walker", "only.style"}).code == 0);
  served.await_frames("walker", 30);
  CHECK(has(served.ctl({"delete-model", "only.style"}).err, "another model, or none"));
  CHECK(served.ctl({"use-model", "walker", "none"}).code == 0);
  served.await_frames("walker", 120);  // it has faded out
  const auto status = nlohmann::json::parse(served.ctl({"--json", "status"}).out);
  CHECK(status["status"]["stream"][0]["stage"][0]["model"] == "");
  CHECK(served.ctl({"use-model", "walker", "only.style"}).code == 0);
  served.await_frames("walker", 30);
  CHECK(served.ctl({"use-model", "walker", "none"}).code == 0);
  CHECK(served.ctl({"delete-model", "only.style"}).code == 0);
  served.await_frames("walker", 30);
  served.daemon->send(SIGTERM);
  REQUIRE(served.daemon->exit_code() == 0);
  served.check_replay();
}

}  // namespace posed::test
