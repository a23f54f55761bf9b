// The demo in any folder: its files are in one folder, are created once, and are created again when
// they differ from what this version creates.
#include <csignal>
#include <fstream>
#include <string>

#include "tests/e2e/outcome.hpp"
#include "tests/support/file_text.hpp"
#include "tests/support/shared.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::test {
namespace {

// The demo's config with free ports.
std::string on_free_ports(std::string toml) {
  for (const char* port : {"127.0.0.1:5570", "127.0.0.1:5571"}) {
    const auto at = toml.find(port);
    REQUIRE(at != std::string::npos);
    toml.replace(at, std::string(port).size(), "127.0.0.1:*");
  }
  return toml;
}

}  // namespace

TEST_CASE("the demo streams from any folder and trains only once", "[demo]") {
  // As in a fresh clone: the config is there, the folder of its files is not.
  const TempFolder folder;
  const auto kept = folder.path() / "build" / "demo";
  create_directory(folder.path() / "config");
  const auto shipped = folder.write(
      "config/demo.toml", on_free_ports(file_text(source_dir() / "config" / "demo.toml")));
  const ProgramOutcome first = posed({"demo", "--config", shipped.string(), "--seconds", "1"});
  INFO(first.err);
  REQUIRE(first.code == 0);
  CHECK(first.err.contains("learning the style"));
  const std::string model = file_text(kept / "walk-to-sneak.style");

  const auto prepare = [&] { return posed({"demo", "--prepare", kept.string()}); };
  const ProgramOutcome again = prepare();
  CHECK(again.code == 0);
  CHECK(has(again.err, "made ... before"));
  CHECK_FALSE(again.err.contains("learning the style"));

  const auto config = kept / "free.toml";
  std::ofstream(config) << on_free_ports(file_text(kept / "demo.toml"));
  const ProgramOutcome streamed = posed({"demo", "--config", config.string(), "--seconds", "1"});
  INFO(streamed.err);
  CHECK(streamed.code == 0);
  CHECK_FALSE(streamed.err.contains("learning the style"));
  CHECK(streamed.out.contains("styled frames over ZeroMQ"));
  CHECK_FALSE(streamed.err.contains("plug the glove in"));  // the emulated one is there
  // The page's address, or how the page is built; the demo goes on either way.
  CHECK((streamed.err.contains("see it: http://127.0.0.1:") ||
         streamed.err.contains("`./run page` builds it")));

  // A page that is open goes on with the next demo.
  const auto token = [](const std::string& text) {
    const auto at = text.find("?token=");
    return at == std::string::npos ? std::string() : text.substr(at, 7 + 22);
  };
  CHECK(token(streamed.err) == token(first.err));
  CHECK(file_text(kept / "demo.toml").contains("models = \".\""));

  // A model that was modified is trained again, with the same bits.
  std::ofstream(kept / "walk-to-sneak.style") << "not a model";
  CHECK(prepare().code == 0);
  CHECK(file_text(kept / "walk-to-sneak.style") == model);
}

TEST_CASE("feet of the demo's walker stand, as he is and in the style", "[demo]") {
  const TempFolder folder;
  const auto in = [&](const char* name) { return (folder.path() / name).string(); };
  REQUIRE(posed({"demo", "--prepare", folder.path().string()}).code == 0);
  REQUIRE(posed({"apply", "--model", in("walk-to-sneak.style"), in("new_walker.bvh"), "--out",
                 in("styled.bvh")})
              .code == 0);
  const auto judged = [&](const char* clip) {
    Process python(Command(
        {"/usr/bin/python3", (source_dir() / "tests/e2e/check_walker.py").string(), in(clip)}));
    UNSCOPED_INFO(python.rest() << python.errors());
    return python.exit_code();
  };
  CHECK(judged("new_walker.bvh") == 0);
  CHECK(judged("styled.bvh") == 0);
  // Without the feet stage the style's feet slide: the judge sees it.
  REQUIRE(posed({"apply", "--model", in("walk-to-sneak.style"), "--root", "off",
                 in("new_walker.bvh"), "--out", in("slides.bvh")})
              .code == 0);
  CHECK(judged("slides.bvh") == 3);
}

TEST_CASE("a demo that was killed while it learnt begins again", "[demo]") {
  const TempFolder folder;
  Process killed({"demo", "--prepare", folder.path().string()});
  REQUIRE(killed.comes_to_say("learning the style"));
  killed.send(SIGKILL);
  REQUIRE(killed.exit_code() == 128 + SIGKILL);
  const ProgramOutcome again = posed({"demo", "--prepare", folder.path().string()});
  INFO(again.err);
  CHECK(again.code == 0);
  CHECK(again.err.contains("learning the style"));
}

TEST_CASE("the demo does not touch a folder that is not its own", "[demo]") {
  const TempFolder folder;
  const auto mine = folder.write("walk_1.bvh", "mine");
  const ProgramOutcome refused = posed({"demo", "--prepare", folder.path().string()});
  CHECK(refused.code == 2);
  CHECK(refused.err.contains("no demo wrote it"));
  CHECK(file_text(mine) == "mine");
  CHECK(posed({"demo", "--prepare", folder.path().string(), "--seconds", "1"}).code == 2);
  const auto other = folder.write("other.toml",
                                  "[[stream]]\nname = \"a\"\ndriver = \"file\"\n"
                                  "[stream.file]\npath = \"march_1.bvh\"\n");
  const ProgramOutcome not_demo = posed({"demo", "--config", other.string()});
  CHECK(not_demo.code == 2);
  CHECK(has(not_demo.err, "no stream ... demo"));
}

}  // namespace posed::test
