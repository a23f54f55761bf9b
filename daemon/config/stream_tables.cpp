#include "daemon/config/config_file.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "proto/text/clean.hpp"
#include "proto/text/nearest_word.hpp"

namespace posed::config {
namespace {

// As many as a replay of their log takes.
constexpr std::size_t kMaxConfigStreams = 256;
constexpr std::size_t kMaxSources = 64;
constexpr std::size_t kMaxBodyBytes = 64;

class StreamReader {
 public:
  StreamReader(const ConfigFile& file, DaemonConfig& config) : file_(file), config_(config) {}

  void read(TableReader& root);

 private:
  void read_stream(TableReader& table);
  void read_device(TableReader& table, StreamConfig stream);
  void read_body(TableReader& table, StreamConfig stream);
  [[nodiscard]] SourceConfig* find_source(TableReader& table, const std::string& name);
  void check_body(TableReader& table, const SourceConfig& source, const std::string& body);
  void check_sources(std::vector<TableReader>& tables);

  const ConfigFile& file_;
  DaemonConfig& config_;
  std::vector<NamedTable> names_;
  // The lines of the tables that name a body, by the source's name and the body's.
  std::map<std::pair<std::string, std::string>, int> body_lines_;
};

void StreamReader::read(TableReader& root) {
  root.read("max_streams", config_.max_streams, {1, kMaxConfigStreams});
  const std::size_t errors = file_.findings.errors.size();
  std::vector<TableReader> sources = root.tables("source", kMaxSources);
  for (TableReader& table : sources) {
    SourceConfig& source = config_.sources.emplace_back();
    source.line = table.line();
    read_source(table, file_, source);
    names_.push_back({.name = source.name, .line = table.line(), .is_source = true});
  }
  std::vector<TableReader> streams = root.tables("stream", kMaxConfigStreams);
  if (sources.empty() && streams.empty() && file_.findings.errors.size() == errors) {
    file_.findings.add_error(0,
                             "there is no stream and no source; add a [[stream]] table with a name"
                             " and a driver, or a [[source]] table for a device with several"
                             " bodies");
  }
  const bool all = std::ranges::any_of(config_.sources, &SourceConfig::all);
  if (std::cmp_greater(streams.size(), config_.max_streams)) {
    root.add_error(root.has("max_streams") ? "max_streams" : "stream",
                   fmt::format("there are {} [[stream]] tables, but max_streams is {}; it takes up"
                               " to {}",
                               streams.size(), config_.max_streams, kMaxConfigStreams));
  } else if (all && std::cmp_equal(streams.size(), config_.max_streams)) {
    root.add_error(root.has("max_streams") ? "max_streams" : "stream",
                   fmt::format("the [[stream]] tables take all {} streams of max_streams, which"
                               " leaves none for the bodies of streams = \"all\"; raise it, up"
                               " to {}",
                               streams.size(), kMaxConfigStreams));
  }
  for (TableReader& table : streams) read_stream(table);
  check_sources(sources);
  check_partners(config_, file_.findings);
  check_names(std::move(names_), file_.findings);
}

void StreamReader::read_stream(TableReader& table) {
  StreamConfig stream;
  stream.line = table.line();
  table.require("name", stream.name);
  const bool of_source = table.has("source") || (table.has("body") && !table.has("driver"));
  if (!of_source) table.require("driver", stream.driver);
  read_settings(table, file_, stream);
  if (table.has_text("name") && !is_stream_name(stream.name)) {
    table.add_error("name", "a stream's name has 1 to 32 of the letters a-z, digits, '-' and '_'");
  }
  if (table.has("skeleton")) {
    table.skip("skeleton");
    table.add_error("skeleton",
                    of_source
                        ? "the mapping of a body's joints stands in its [[source]] table"
                        : "the mapping of a clip's joints stands in [stream.file], as profile;"
                          " other devices with one body have a skeleton of posed's own");
  }
  names_.push_back({.name = stream.name, .line = table.line(), .publish_raw = stream.publish_raw});
  if (of_source) {
    read_body(table, std::move(stream));
  } else {
    read_device(table, std::move(stream));
  }
  table.finish();
}

// A device with one body.
void StreamReader::read_device(TableReader& table, StreamConfig stream) {
  std::string calibration;
  table.read("calibration", calibration);
  stream.calibration = file_.resolve(calibration);
  std::string ignored;
  table.read("source", ignored);
  table.read("body", ignored);
  if (table.has("body")) {
    table.add_error("body",
                    "body says which body of a source it is; write source = \"NAME\" in place of"
                    " the driver, or leave body out");
  }
  const drivers::Driver* driver = named_driver(table, file_, stream.driver);
  if (driver != nullptr && driver->make_layout != nullptr) {
    table.add_error("driver",
                    fmt::format("{} delivers several bodies; name it in a [[source]] table, and in"
                                " [[stream]] tables one body each, with source and body",
                                driver->name));
    skip_driver_tables(table, file_);
  } else if (driver != nullptr) {
    read_options(table, file_, *driver, stream.options);
  }
  config_.streams.push_back(std::move(stream));
}

// One body of a source.
void StreamReader::read_body(TableReader& table, StreamConfig stream) {
  std::string source_name;
  std::string body;
  table.require("source", source_name);
  table.require("body", body);
  SourceConfig* source = find_source(table, source_name);
  if (table.has("driver")) {
    table.skip("driver");
    table.add_error("driver",
                    "a stream has a driver or a source; leave out the driver to stream a body of"
                    " the source, or source and body to open a device with one body");
    skip_device_keys(table, file_);
  } else {
    refuse_device_keys(table, file_, source == nullptr ? "" : source->driver);
  }
  if (table.has_text("body") && (body.empty() || body.size() > kMaxBodyBytes)) {
    table.add_error("body", fmt::format("stream.body is the device's own name for the body, 1 to {}"
                                        " bytes",
                                        kMaxBodyBytes));
  }
  if (source == nullptr) return;
  check_body(table, *source, body);
  source->named.push_back({.body = std::move(body), .stream = std::move(stream)});
}

SourceConfig* StreamReader::find_source(TableReader& table, const std::string& name) {
  const auto found = std::ranges::find(config_.sources, name, &SourceConfig::name);
  if (name.empty()) return nullptr;
  if (found != config_.sources.end()) return &*found;
  std::set<std::string> names;
  for (const SourceConfig& source : config_.sources) names.insert(source.name);
  const std::string near = nearest(name, names);
  table.add_error("source",
                  fmt::format("there is no [[source]] table named {}; {}", in_quotes(name),
                              near.empty() ? "add one with the device's driver"
                                           : "the nearest is " + in_quotes(near)));
  return nullptr;
}

void StreamReader::check_body(TableReader& table, const SourceConfig& source,
                              const std::string& body) {
  if (body.empty()) return;
  const auto [first, is_new] = body_lines_.try_emplace({source.name, body}, table.line());
  if (is_new) return;
  table.add_error("body",
                  fmt::format("a second stream has body {} of source {} (the first stands in"
                              " line {}); a body is one stream",
                              in_quotes(body), in_quotes(source.name), first->second));
}

void StreamReader::check_sources(std::vector<TableReader>& tables) {
  std::set<std::string> seen;
  for (std::size_t i = 0; i < tables.size(); ++i) {
    const SourceConfig& source = config_.sources[i];
    // A name that is missing or taken, or a wrong streams, has its error already.
    if (source.name.empty() || !seen.insert(source.name).second) continue;
    if (tables[i].has("streams") || !source.named.empty()) continue;
    file_.findings.add_error(
        tables[i].line(),
        fmt::format("nothing of source {} would be streamed; add streams = \"all\", or a [[stream]]"
                    " table with source and body for each body",
                    in_quotes(source.name)));
  }
}

}  // namespace

void read_streams(TableReader& root, const ConfigFile& file, DaemonConfig& config) {
  StreamReader(file, config).read(root);
}

}  // namespace posed::config
