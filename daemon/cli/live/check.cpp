// `posed check`: does everything that `run` does before it binds a socket, and prints the results.
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "daemon/cli/cli.hpp"
#include "daemon/config/config.hpp"
#include "daemon/config/take_tables.hpp"
#include "daemon/devices/about_stream.hpp"
#include "daemon/devices/open_source.hpp"
#include "daemon/devices/stream_stages.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/json_text.hpp"

namespace posed::cli {
namespace {

using nlohmann::ordered_json;

struct CheckOptions {
  std::filesystem::path config;
  bool json = false;
};

// The stage with its model and parameters, in the names and units of the config.
ordered_json summary_of(const pipeline::StageSettings& stage) {
  ordered_json summary{{"stage", stage.type->name}};
  if (!stage.model_name.empty()) summary["model"] = stage.model_name;
  summary["parameters"] = ordered_json::object();
  for (const ParameterSpec& spec : stage.type->parameters) {
    const ParameterValue& value = stage.parameters.at(std::string(spec.name));
    ordered_json& shown = summary["parameters"][std::string(spec.shown_name())];
    std::visit([&](const auto& it) { shown = it; }, value);
    if (std::holds_alternative<double>(value)) shown = std::get<double>(value) * spec.people_scale;
  }
  return summary;
}

// A description of what the stream would run, made with its device opened and its model bound.
// Streams after it may have it as a partner.
Result<ordered_json> try_stream(const config::StreamConfig& config,
                                pipeline::PartnerStreams& partners) {
  devices::ModelFiles files;
  const auto source = devices::open_source(config::source_of(config), files);
  if (!source) return std::unexpected(source.error());
  const drivers::Body body = devices::only_body(**source);
  auto stages = devices::load_stages(config, body.skeleton, body.rate_hz, files, partners);
  if (!stages) return devices::of_stream(config.name, stages.error());
  partners[config.name] = {
      .stream = static_cast<std::uint32_t>(partners.size()),
      .about = {.skeleton = stages->published, .rate_hz = stages->settings.rate_hz}};
  const auto missing = devices::try_kept_device(**source);
  if (!missing) return devices::of_stream(config.name, missing.error());
  const auto bound = devices::bind_stages(*stages);
  if (!bound) return devices::of_stream(config.name, bound.error());
  const auto engine = devices::make_engine(0, *stages, *bound);
  if (!engine) return devices::of_stream(config.name, engine.error());
  const drivers::Description& device = (*source)->device.description;
  ordered_json summary{{"name", config.name},
                       {"driver", config.driver},
                       {"device", device.identity},
                       {"rate_hz", device.rate_hz},
                       {"joints", device.skeleton ? device.skeleton->joints.size() : 0},
                       {"sample_values", device.samples.names.size()},
                       {"publish_raw", config.publish_raw},
                       {"stale_after_s", config.stale_after_s}};
  summary["stages"] = ordered_json::array();
  for (const pipeline::StageSettings& stage : stages->settings.stages) {
    summary["stages"].push_back(summary_of(stage));
  }
  summary["present"] = missing->empty();
  summary["warnings"] = (*source)->device.warnings;
  if (!missing->empty()) {
    summary["warnings"].push_back("the device is not here now, and `posed run` waits for it (" +
                                  *missing + ")");
  }
  return summary;
}

// What is known about a source before its device describes its bodies.
ordered_json summary_of(const config::SourceConfig& source) {
  ordered_json summary{{"name", source.name}, {"driver", source.driver}, {"all", source.all}};
  summary["streams"] = ordered_json::array();
  for (const auto& named : source.named) {
    summary["streams"].push_back({{"name", named.stream.name}, {"body", named.body}});
  }
  return summary;
}

ordered_json summary_of(const config::OutputConfig& output) {
  ordered_json summary{{"name", output.name}, {"kind", config::kind_name(output.kind)}};
  for (const auto& [part, stream] : {std::pair{"body", output.body},
                                     {"left_hand", output.left_hand},
                                     {"right_hand", output.right_hand}}) {
    if (!stream.empty()) summary[part] = stream;
  }
  if (output.kind == config::OutputKind::kVmc) summary["to"] = output.to;
  if (output.kind == config::OutputKind::kBvh) summary["listen"] = output.listen;
  if (output.rate_hz > 0.0) summary["rate_hz"] = output.rate_hz;
  return summary;
}

ordered_json summary_of(const config::RecordConfig& record) {
  return {{"folder", record.folder.string()}, {"frames", record.frames}, {"clips", record.clips}};
}

ordered_json summary_of(const config::TriggerConfig& trigger) {
  return {{"listen", trigger.listen}, {"peers", trigger.peers}};
}

ordered_json summary_of(const config::MetricsConfig& metrics) {
  return {{"listen", metrics.listen}};
}

std::string security_of(const config::DaemonConfig& config) {
  if (config.security.server_key.empty()) return "no keys";
  return "keys, " + std::to_string(config.security.clients.size()) + " clients allowed";
}

// "optitrack: template_mocap, body 'Ann' as ann, all other bodies"
void print_source(const ordered_json& source) {
  std::printf("%s: %s", source["name"].get<std::string>().c_str(),
              source["driver"].get<std::string>().c_str());
  for (const ordered_json& stream : source["streams"]) {
    std::printf(", body %s as %s", in_quotes(stream["body"].get<std::string>()).c_str(),
                stream["name"].get<std::string>().c_str());
  }
  if (source["all"].get<bool>()) {
    std::printf(", all %sbodies", source["streams"].empty() ? "" : "other ");
  }
  std::puts("");
}

// "output vmc-ann: vmc, body ann, to 127.0.0.1:39539"
void print_output(const ordered_json& output) {
  std::string line =
      "output " + output["name"].get<std::string>() + ": " + output["kind"].get<std::string>();
  for (const char* part : {"body", "left_hand", "right_hand"}) {
    if (output.contains(part))
      line += std::string(", ") + part + " " + output[part].get<std::string>();
  }
  if (output.contains("listen")) line += ", on " + output["listen"].get<std::string>();
  for (const ordered_json& to : output.value("to", ordered_json::array()))
    line += ", to " + to.get<std::string>();
  if (output.contains("rate_hz")) {
    line += ", at most " + json_text(output["rate_hz"]) + " Hz";
  }
  std::puts(clean(line).c_str());
}

// "records to takes, with the published frames, each take as BVH"
void print_record(const config::RecordConfig& record) {
  const std::string folder = clean(record.folder.string());
  std::printf("records to %s%s%s\n", folder.c_str(),
              record.frames ? ", with the published frames" : "",
              record.clips ? ", each take as BVH" : "");
}

// "takes are triggered at 127.0.0.1:1512 by 192.168.1.20"
void print_trigger(const config::TriggerConfig& trigger) {
  std::string line = "takes are triggered at " + trigger.listen + " by ";
  if (trigger.peers.empty()) line += "this machine";
  for (std::size_t i = 0; i < trigger.peers.size(); ++i) {
    line += (i == 0 ? "" : ", ") + trigger.peers[i];
  }
  std::puts(clean(line).c_str());
}

void print(const config::DaemonConfig& config, const ordered_json& streams,
           const ordered_json& sources, const ordered_json& outputs) {
  std::printf("publishes on %s, controlled on %s (%s)\n", config.publish_endpoint.c_str(),
              config.control_endpoint.c_str(), security_of(config).c_str());
  for (const ordered_json& stream : streams) {
    const std::string device = clean(stream["device"].get<std::string>());
    std::printf("%s: %s%s%s, %g Hz, %d joints", stream["name"].get<std::string>().c_str(),
                stream["driver"].get<std::string>().c_str(),
                stream["present"].get<bool>() ? " " : " (away)", device.c_str(),
                stream["rate_hz"].get<double>(), stream["joints"].get<int>());
    for (const ordered_json& stage : stream["stages"]) {
      std::printf(", %s", stage["stage"].get<std::string>().c_str());
      if (stage.contains("model")) {
        std::printf(" %s", clean(stage["model"].get<std::string>()).c_str());
      }
      std::string values;
      for (const auto& [name, value] : stage["parameters"].items()) {
        values += (values.empty() ? "" : " ") + name + "=" + json_text(value);
      }
      if (!values.empty()) std::printf(" (%s)", clean(values).c_str());
    }
    std::puts(stream["publish_raw"].get<bool>() ? ", raw input too" : "");
    for (const auto& warning : stream["warnings"]) {
      std::printf("  note: %s\n", clean(warning.get<std::string>()).c_str());
    }
  }
  for (const ordered_json& source : sources) print_source(source);
  for (const ordered_json& output : outputs) print_output(output);
  if (config.record) print_record(*config.record);
  if (config.trigger) print_trigger(*config.trigger);
  if (config.metrics) std::printf("metrics on http://%s/metrics\n", config.metrics->listen.c_str());
}

// Returns 0 if everything would run; 2 if the config is wrong; 1 if it is right, but a file or a
// device that it names cannot be used.
int check(const CheckOptions& options) {
  config::Reading reading = config::read_config_file(options.config, drivers::registry());
  ordered_json streams = ordered_json::array();
  ordered_json sources = ordered_json::array();
  if (reading.errors.empty()) {
    const auto& configs = reading.config.streams;
    std::vector<ordered_json> tried(configs.size());
    pipeline::PartnerStreams partners;
    std::vector<const config::StreamConfig*> streams_of_devices;
    for (const config::StreamConfig& stream : configs) streams_of_devices.push_back(&stream);
    for (const std::size_t i : devices::building_order(streams_of_devices)) {
      auto summary = try_stream(configs[i], partners);
      if (summary) tried[i] = std::move(*summary);
      if (!summary) reading.errors.push_back(summary.error());
    }
    for (ordered_json& summary : tried) {
      if (!summary.is_null()) streams.push_back(std::move(summary));
    }
    for (const config::SourceConfig& source : reading.config.sources) {
      devices::ModelFiles models;
      const auto opened = devices::open_source(source, models);
      if (!opened) reading.errors.push_back(opened.error());
      sources.push_back(summary_of(source));
    }
    if (const auto& record = reading.config.record) {
      if (auto fine = config::check_folder(*record); !fine) {
        reading.errors.push_back({.message = fine.error().message,
                                  .file = options.config.string(),
                                  .line = record->line});
      }
    }
  }
  ordered_json outputs = ordered_json::array();
  for (const config::OutputConfig& output : reading.config.outputs) {
    outputs.push_back(summary_of(output));
  }
  int exit_code = 0;
  ordered_json errors = ordered_json::array();
  for (const Error& error : reading.errors) {
    exit_code = std::max(exit_code, report(error));
    errors.push_back({{"file", error.file}, {"line", error.line}, {"message", error.message}});
  }
  if (options.json) {
    ordered_json all{{"ok", errors.empty()},
                     {"publish", reading.config.publish_endpoint},
                     {"control", reading.config.control_endpoint},
                     {"streams", streams},
                     {"sources", sources},
                     {"outputs", outputs}};
    if (reading.config.record) all["record"] = summary_of(*reading.config.record);
    if (reading.config.trigger) all["trigger"] = summary_of(*reading.config.trigger);
    if (reading.config.metrics) all["metrics"] = summary_of(*reading.config.metrics);
    all["errors"] = errors;
    std::printf("%s\n", json_text(all).c_str());
  } else if (errors.empty()) {
    print(reading.config, streams, sources, outputs);
  }
  return exit_code;
}

}  // namespace

void add_check(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand("check", "Check a config and everything that it names");
  auto options = std::make_shared<CheckOptions>();
  command->add_option("--config", options->config, "The daemon's config, TOML")
      ->required()
      ->type_name("FILE");
  command->add_flag("--json", options->json, "What would run, or all errors, as one JSON object");
  command->footer(R"(Examples:
  posed check --config config/posed.toml
  posed check --config mine.toml --json | jq .errors
Every error is reported with file and line. Exit code 0: it would run, though a glove that is
unplugged is only waited for (a note says so, "present" in JSON is false). 2: the config is wrong.
1: the config is right, but a clip, model or device that it names cannot be used.)");
  command->callback([options, &exit_code] { exit_code = check(*options); });
}

}  // namespace posed::cli
