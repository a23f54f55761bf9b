// Every config in a README can be used as it stands.
#include <map>
#include <string>

#include <catch2/catch.hpp>

#include "daemon/config/config.hpp"
#include "drivers/described/device_file.hpp"
#include "tests/support/readme_blocks.hpp"

namespace posed::config {
namespace {

// What the text around a page's examples takes for granted.
const std::map<std::string, std::string> kGranted{
    {"config/README.md",
     "[[source]]\nname = \"optitrack\"\ndriver = \"natnet\"\n"
     "[source.natnet]\nserver = \"192.168.1.20\"\n"}};

TEST_CASE("the examples of configs in READMEs are right") {
  std::map<std::string, std::string> configs;  // the blocks of a page belong together
  int descriptions = 0;
  for (const test::ReadmeBlock& block : test::readme_blocks()) {
    if (block.language != "toml") continue;
    if (block.text.find("[[packet]]") == std::string::npos) {
      configs[block.file] += block.text;
      continue;
    }
    const auto device = drivers::described::parse_device(block.text, block.file);
    INFO(block.file << ":" << block.line);
    if (!device) FAIL_CHECK(device.error().text());
    ++descriptions;
  }
  CHECK(configs.size() > 10);
  CHECK(descriptions > 0);
  for (const auto& [file, text] : configs) {
    const auto granted = kGranted.find(file);
    const std::string whole = granted == kGranted.end() ? text : granted->second + text;
    INFO(whole);
    // The keys and files that an example names are the reader's own.
    for (const Error& error :
         read_config(whole, test::source_dir() / file, drivers::registry()).errors) {
      if (error.message.find("cannot read the key") == std::string::npos) FAIL_CHECK(error.text());
    }
  }
}

}  // namespace
}  // namespace posed::config
