#include "daemon/config/config_file.hpp"

#include <string>

#include <spdlog/fmt/fmt.h>

#include "daemon/config/config.hpp"
#include "models/stages/registry.hpp"

namespace posed::config {
namespace {

constexpr Range kSourceRate{1.0, 1000.0};  // frames a second

void read_which_bodies(TableReader& table, SourceConfig& source) {
  std::string streams;
  table.read("streams", streams);
  source.all = streams == "all";
  if (source.all || !table.has("streams")) return;
  // A value that is no text has its error already.
  if (table.has_text("streams")) {
    table.add_error("streams",
                    "source.streams takes one value, \"all\"; leave it out to stream only the"
                    " bodies that [[stream]] tables name");
  }
}

// Settings for all bodies, although not all of them are streamed.
void refuse_settings(TableReader& table) {
  const auto refuse = [&](std::string_view key, const std::string& shown) {
    if (!table.has(key)) return;
    table.add_error(key, fmt::format("{} is for the bodies of streams = \"all\"; add that line, or"
                                     " write it into the [[stream]] table of a body",
                                     shown));
  };
  for (const char* key : {"publish_raw", "stale_after_s", "stages"}) {
    refuse(key, table.path() + "." + key);
  }
  for (const StageType* stage : stage_types()) {
    refuse(stage->name, fmt::format("[{}.{}]", table.path(), stage->name));
  }
}

void check_name(TableReader& table, const SourceConfig& source) {
  if (!table.has_text("name")) return;
  if (!is_stream_name(source.name)) {
    table.add_error("name", "a source's name has 1 to 32 of the letters a-z, digits, '-' and '_'");
  } else if (source.all && source.name.size() > kMaxPrefixBytes) {
    table.add_error("name",
                    fmt::format("with streams = \"all\" a source's name has at most {} letters,"
                                " because the names of its streams begin with it",
                                kMaxPrefixBytes));
  }
}

void read_driver(TableReader& table, const ConfigFile& file, SourceConfig& source) {
  const drivers::Driver* driver = named_driver(table, file, source.driver);
  if (driver == nullptr) return;
  if (driver->make_layout != nullptr) return read_options(table, file, *driver, source.options);
  table.add_error("driver", fmt::format("{0} has one body; name it in a [[stream]] table with"
                                        " driver = \"{0}\"",
                                        driver->name));
  skip_device_keys(table, file);
}

}  // namespace

void read_source(TableReader& table, const ConfigFile& file, SourceConfig& source) {
  table.require("name", source.name);
  table.require("driver", source.driver);
  table.read("rate_hz", source.rate_hz, kSourceRate);
  std::string skeleton;
  table.read("skeleton", skeleton);
  source.skeleton = file.resolve(skeleton);
  read_which_bodies(table, source);
  read_settings(table, file, source.every);
  if (!table.has("streams")) refuse_settings(table);
  check_name(table, source);
  read_driver(table, file, source);
  table.finish();
}

}  // namespace posed::config
