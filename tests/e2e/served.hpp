// A daemon for one test: a small walking skeleton, a style for it, optional keys, ephemeral ports.
#pragma once

#include <string>
#include <vector>

#include <catch2/catch.hpp>

#include "models/style/model/style_model.hpp"
#include "proto/clip/clip.hpp"
#include "tests/e2e/stage.hpp"
#include "tests/unit/models/style/toy_style.hpp"

namespace posed::test {

class Served : public Stage {
 public:
  // `security` is TOML text that is put before the streams.
  explicit Served(const std::string& security = "") {
    REQUIRE(clip::write_bvh(toy_walk(240, 120.0), folder.path() / "walk.bvh"));
    REQUIRE(style::save_model(toy_model(1, 0.3), folder.path() / "one.style"));
    REQUIRE(style::save_model(toy_model(2, 0.3), folder.path() / "two.style"));
    write_config(security);
  }

  void write_config(const std::string& security) const {
    folder.write("posed.toml", kEndpoints + security + R"(
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

  void start(const std::vector<std::string>& options = {}) { launch("run", options); }
};

}  // namespace posed::test
