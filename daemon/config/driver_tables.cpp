#include "daemon/config/config_file.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <set>
#include <string>

#include <spdlog/fmt/fmt.h>

#include "proto/text/clean.hpp"
#include "proto/text/nearest_word.hpp"

namespace posed::config {
namespace {

constexpr std::array<std::string_view, 3> kIdentityKeys{"port", "id", "hand"};

// The driver that somebody most likely means: of nearly that name, or for devices of that name.
std::string nearest_driver(const std::string& name, Drivers known) {
  constexpr std::size_t kMinWord = 4;  // a shorter one is part of too many
  std::set<std::string> names;
  for (const drivers::Driver& driver : known) names.emplace(driver.name);
  const std::string near = nearest(name, names);
  if (!near.empty() || name.size() < kMinWord) return near;
  const auto same = [](char a, char b) { return std::tolower(a) == std::tolower(b); };
  for (const drivers::Driver& driver : known) {
    if (!std::ranges::search(driver.summary, name, same).empty()) return std::string(driver.name);
  }
  return {};
}

}  // namespace

const drivers::Driver* named_driver(TableReader& table, const ConfigFile& file,
                                    const std::string& name) {
  const auto driver = std::ranges::find(file.drivers, name, &drivers::Driver::name);
  if (driver != file.drivers.end()) return &*driver;
  if (name.empty()) return nullptr;
  const std::string near = nearest_driver(name, file.drivers);
  table.add_error("driver", fmt::format("there is no driver of this name; {}",
                                        near.empty() ? "`posed devices` lists them"
                                                     : "the nearest is '" + near +
                                                           "' (`posed devices` lists them)"));
  skip_driver_tables(table, file);
  return nullptr;
}

void read_options(TableReader& table, const ConfigFile& file, const drivers::Driver& driver,
                  drivers::Options& options) {
  const std::string name(driver.name);
  auto own_table = table.table(name);
  for (const drivers::OptionSpec& spec : driver.options) {
    const std::string key(spec.name);
    drivers::OptionValue value = spec.default_value;
    // Keys that say which device it is stand beside the driver's name; keys that say how it is used
    // stand in the driver's own table.
    const bool beside = driver.expect != nullptr &&
                        std::ranges::find(kIdentityKeys, spec.name) != kIdentityKeys.end();
    if (beside) file.read_parameter(table, spec, value);
    if (!beside && own_table) file.read_parameter(*own_table, spec, value);
    if (spec.required && !(beside ? table.has(key) : own_table && own_table->has(key))) {
      file.findings.add_error(
          own_table ? own_table->line() : table.line(),
          fmt::format("{}.{}.{} is missing: {}", table.path(), name, key, spec.help));
    }
    options[key] = std::move(value);
  }
  if (own_table) own_table->finish();
}

void skip_driver_tables(TableReader& table, const ConfigFile& file) {
  for (const drivers::Driver& driver : file.drivers) table.skip(driver.name);
}

void refuse_device_keys(TableReader& table, const ConfigFile& file, const std::string& driver) {
  if (table.has("calibration")) {
    table.add_error("calibration",
                    "calibration is for a glove, and this stream is a body of a source; leave it"
                    " out");
  }
  for (const std::string_view key : kIdentityKeys) {
    if (!table.has(key)) continue;
    table.add_error(key, fmt::format("{} says which device it is, and this stream's device is that"
                                     " of its source; leave it out",
                                     key));
  }
  for (const drivers::Driver& one : file.drivers) {
    if (!table.has(one.name)) continue;
    table.add_error(
        one.name,
        fmt::format("[{}.{}] has a driver's options, and this stream's device is that"
                    " of its source; they stand in [source.{}]",
                    table.path(), one.name, driver.empty() ? "DRIVER" : clean_name(driver)));
  }
  skip_device_keys(table, file);
}

void skip_device_keys(TableReader& table, const ConfigFile& file) {
  table.skip("calibration");
  for (const std::string_view key : kIdentityKeys) table.skip(key);
  skip_driver_tables(table, file);
}

}  // namespace posed::config
