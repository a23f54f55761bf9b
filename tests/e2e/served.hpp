// A daemon of a test's own: a walking toy, a style for it, keys if wanted, ephemeral ports.
#pragma once

#include <string>

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "models/style/style_model.hpp"
#include "proto/clip/clip.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/models/toy_style.hpp"

namespace posed::test {

class Served {
 public:
  // `security` is TOML put before the streams; {} are the endpoints' defaults of a test.
  explicit Served(const std::string& security = "") {
    REQUIRE(clip::write_bvh(toy_walk(240, 120.0), folder.path() / "walk.bvh"));
    REQUIRE(style::save_model(toy_model(1, 0.3), folder.path() / "one.style"));
    REQUIRE(style::save_model(toy_model(2, 0.3), folder.path() / "two.style"));
    write_config(security);
  }

  void write_config(const std::string& security) const {
    folder.write("posed.toml", R"(realtime = false
[publish]
endpoint = "tcp://127.0.0.1:*"
[control]
endpoint = "tcp://127.0.0.1:*"
)" + security + R"(
[[stream]]
name = "walker"
driver = "file"
publish_raw = true
[stream.file]
path = "walk.bvh"
loop = true
[stream.style]
model = "one.style"
)");
  }

  [[nodiscard]] std::string path(const std::string& name) const {
    return (folder.path() / name).string();
  }

  // Starts `posed run` with these options, too, and waits until it is ready.
  void start(const std::vector<std::string>& options = {}) {
    std::vector<std::string> arguments{"run", "--config", path("posed.toml")};
    arguments.insert(arguments.end(), options.begin(), options.end());
    daemon.emplace(std::move(arguments));
    const auto line = daemon->line();
    INFO(daemon->errors());
    REQUIRE(line);
    const auto ready = nlohmann::json::parse(*line);
    publish = ready.at("publish");
    control = ready.at("control");
  }

  TempFolder folder;
  std::optional<Process> daemon;
  std::string publish, control;
};

inline bool has(const std::string& text, const std::string& part) {
  INFO(text);
  return text.find(part) != std::string::npos;
}

}  // namespace posed::test
