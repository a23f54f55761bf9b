// `posed check`: does everything that `run` does before it binds a socket, and prints the results.
#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>
#include <CLI/CLI.hpp>

#include "daemon/config/config.hpp"
#include "daemon/config/take_tables.hpp"
#include "daemon/control/model_folder.hpp"
#include "daemon/devices/about_stream.hpp"
#include "daemon/devices/open_source.hpp"
#include "daemon/devices/stream_stages.hpp"
#include "daemon/output/vmc_output.hpp"
#include "daemon/tools/command/command.hpp"
#include "daemon/tools/command/findings.hpp"
#include "drivers/transport/address.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/list.hpp"
#include "proto/zmq/zmq_handle.hpp"

namespace posed::tools {
namespace {

struct CheckOptions {
  std::filesystem::path config;
  bool json = false;
};

// A parameter as the config writes it.
template <typename T>
void add_parameter(const ParameterSpec& spec, const T& value, Findings& parameters) {
  if constexpr (std::is_same_v<T, double>) {
    parameters.add(std::string(spec.shown_name()), value * spec.display_scale);
  } else {
    parameters.add(std::string(spec.shown_name()), value);
  }
}

// The stage with its model and parameters, in the names and units of the config; `line` gets a part
// about it.
Findings findings_of(const pipeline::StageSettings& stage, const config::StreamConfig& config,
                     std::string& line) {
  Findings findings, parameters;
  findings.add("stage", stage.type->name);
  line += fmt::format(", {}", stage.type->name);
  if (!stage.model_name.empty()) {
    findings.add("model", stage.model_name);
    line += " " + clean(stage.model_name);
  }
  // Of a file that has been read the settings have the text, and the config the path.
  const auto own = std::ranges::find(config.stages, stage.type, &config::StageConfig::type);
  for (const ParameterSpec& spec : stage.type->parameters) {
    const bool is_read = spec.is_path && own != config.stages.end();
    std::visit([&](const auto& value) { add_parameter(spec, value, parameters); },
               (is_read ? own->parameters : stage.parameters).at(std::string(spec.name)));
  }
  std::string values;
  for (const Finding& parameter : parameters.all()) {
    add_word(values, parameter.text + "=" + parameter.json(), " ");
  }
  if (!values.empty()) line += " (" + clean(values) + ")";
  return findings.add("parameters", parameters);
}

// Describes what the stream would run, found out with its device opened and its models bound.
// Streams after it may have it as a partner.
Result<Findings> try_stream(const config::StreamConfig& config,
                            pipeline::PartnerStreams& partners) {
  devices::ModelFiles files;
  const auto source = TRY(devices::open_source(config::source_of(config), files));
  const drivers::Body body = devices::only_body(*source);
  auto stages = devices::load_stages(config, body.skeleton, body.rate_hz, files, partners);
  if (!stages) return devices::in_stream(config.name, stages.error());
  partners[config.name] = {
      .stream = static_cast<std::uint32_t>(partners.size()),
      .about = {.skeleton = stages->published, .rate_hz = stages->settings.rate_hz}};
  const auto missing = devices::try_kept_device(*source);
  if (!missing) return devices::in_stream(config.name, missing.error());
  const auto bound = devices::bind_stages(*stages, files);
  if (!bound) return devices::in_stream(config.name, bound.error());
  const auto engine = devices::make_engine(0, *stages, *bound);
  if (!engine) return devices::in_stream(config.name, engine.error());
  const drivers::Description& device = source->device.description;
  const std::size_t joints = device.skeleton ? device.skeleton->joints.size() : 0;
  std::vector<std::string> warnings = source->device.warnings;
  for (const auto& model : bound->models) {
    if (model && !model->remark.empty()) warnings.push_back(model->remark);
  }
  if (!missing->empty()) {
    warnings.push_back("the device is not here now, and `posed run` waits for it (" + *missing +
                       ")");
  }
  std::string line = fmt::format("{}: {}{}{}, {:g} Hz, {} joints", config.name, config.driver,
                                 missing->empty() ? " " : " (away)", clean(device.identity),
                                 device.rate_hz, joints);
  std::vector<Findings> stage_findings;
  for (const pipeline::StageSettings& stage : stages->settings.stages) {
    stage_findings.push_back(findings_of(stage, config, line));
  }
  if (config.publish_raw) line += ", raw input too";
  Findings findings;
  findings.say(line)
      .add("name", config.name)
      .add("driver", config.driver)
      .add("device", device.identity)
      .add("rate_hz", device.rate_hz)
      .add("joints", joints)
      .add("sample_values", device.samples.names.size())
      .add("publish_raw", config.publish_raw)
      .add("stale_after_s", config.stale_after_s)
      .add("stages", stage_findings)
      .add("present", missing->empty())
      .add("warnings", warnings);
  for (const std::string& warning : warnings) findings.say("  note: " + clean(warning));
  return findings;
}

// The models that the bodies of a source will have.
std::set<std::string> models_of(const config::SourceConfig& source) {
  std::set<std::string> models;
  const auto add = [&models](const config::StreamConfig& stream) {
    for (const config::StageConfig& stage : stream.stages) {
      if (!stage.model.empty()) models.insert(stage.model.filename().string());
    }
  };
  add(source.every);
  for (const auto& named : source.named) add(named.stream);
  return models;
}

// What is known about a source before its device describes its bodies. The line is like "optitrack:
// template_mocap, body 'Ann' as ann, all other bodies".
Findings findings_of(const config::SourceConfig& source) {
  std::vector<Findings> streams;
  std::string line = source.name + ": " + source.driver;
  for (const auto& named : source.named) {
    streams.push_back(Findings().add("name", named.stream.name).add("body", named.body));
    line += ", body " + in_quotes(named.body) + " as " + named.stream.name;
  }
  if (source.all) line += streams.empty() ? ", all bodies" : ", all other bodies";
  const std::set<std::string> models = models_of(source);
  Findings findings;
  findings.add("name", source.name)
      .add("driver", source.driver)
      .add("all", source.all)
      .add("streams", streams)
      .add("models", std::vector(models.begin(), models.end()))
      .say(line);
  if (!models.empty()) {
    findings.say(
        fmt::format("  note: each body is asked whether {} can serve it when it comes; "
                    "`posed top` shows one that is refused, and why",
                    clean(joined(models))));
  }
  return findings;
}

void add_ros2(const config::OutputConfig& output, Findings& findings, std::string& line) {
  findings.add("streams", output.bodies).add("domain", output.domain);
  findings.add("interface", output.interface);
  line += fmt::format(", streams {}, DDS domain {} on {}", fmt::join(output.bodies, " "),
                      output.domain, output.interface);
  if (!output.peers.empty()) line += fmt::format(", with {}", fmt::join(output.peers, " "));
  if (!output.topic.empty()) line += ", topic " + output.topic;
}

// The line is like "output vmc-ann: vmc, body ann, to 127.0.0.1:39539".
Findings findings_of(const config::OutputConfig& output) {
  const std::string kind(config::kind_name(output.kind));
  Findings findings;
  findings.add("name", output.name).add("kind", kind);
  std::string line = "output " + output.name + ": " + kind;
  for (const auto& [part, stream] : {std::pair{"body", output.body},
                                     {"left_hand", output.left_hand},
                                     {"right_hand", output.right_hand}}) {
    if (stream.empty()) continue;
    findings.add(part, stream);
    line += std::string(", ") + part + " " + stream;
  }
  const bool ros2 = output.kind == config::OutputKind::kRos2;
  if (ros2) {
    add_ros2(output, findings, line);
  } else if (!output.bodies.empty()) {
    findings.add("bodies", output.bodies);
    line += fmt::format(", bodies {}", fmt::join(output.bodies, " "));
  }
  if (ros2) {
    // Nobody connects to it, and it finds its readers by itself.
  } else if (output.to.empty()) {
    findings.add("listen", output.listen);
    line += ", on " + output.listen;
    if (!output.group.empty()) {
      findings.add("group", output.group);
      line += fmt::format(", to the group {}:{}", output.group, output.data_port);
    }
  } else {
    findings.add("to", output.to);
    for (const std::string& to : output.to) line += ", to " + to;
  }
  if (!output.avatar.empty()) {
    findings.add("avatar", output.avatar.string());
    line += ", with the bones of " + output.avatar.string();
  }
  if (output.rate_hz > 0.0) {
    findings.add("rate_hz", output.rate_hz);
    line += ", at most " + findings.all().back().json() + " Hz";
  }
  return findings.say(clean(line));
}

// The line is like "records to takes, with the published frames, each take as BVH".
Findings findings_of(const config::RecordConfig& record) {
  return Findings()
      .add("folder", record.folder.string())
      .add("frames", record.frames)
      .add("clips", record.clips)
      .say(fmt::format("records to {}{}{}", clean(record.folder.string()),
                       record.frames ? ", with the published frames" : "",
                       record.clips ? ", each take as BVH" : ""));
}

// The line is like "takes are triggered at 127.0.0.1:1512 by 192.168.1.20".
Findings findings_of(const config::TriggerConfig& trigger) {
  const std::string peers = trigger.peers.empty() ? "this machine" : joined(trigger.peers);
  return Findings()
      .add("listen", trigger.listen)
      .add("peers", trigger.peers)
      .say(clean("takes are triggered at " + trigger.listen + " by " + peers));
}

std::string security_of(const config::DaemonConfig& config) {
  if (config.security.server_key.empty()) return "no keys";
  return "keys, " + std::to_string(config.security.clients.size()) + " clients allowed";
}

// Tries everything that the config names, and adds what cannot be used to the errors.
void try_all(const std::string& file, config::Reading& reading, std::vector<Findings>& streams,
             std::vector<Findings>& sources) {
  const auto& configs = reading.config.streams;
  std::vector<std::optional<Findings>> tried(configs.size());
  pipeline::PartnerStreams partners;
  std::vector<const config::StreamConfig*> streams_of_devices;
  for (const config::StreamConfig& stream : configs) streams_of_devices.push_back(&stream);
  for (const std::size_t i : devices::building_order(streams_of_devices)) {
    auto found = try_stream(configs[i], partners);
    if (found) tried[i] = std::move(*found);
    if (!found) reading.errors.push_back(found.error());
  }
  for (std::optional<Findings>& found : tried) {
    if (found) streams.push_back(std::move(*found));
  }
  for (const config::SourceConfig& source : reading.config.sources) {
    devices::ModelFiles models;
    const auto opened = devices::open_source(source, models);
    if (!opened) reading.errors.push_back(opened.error());
    sources.push_back(findings_of(source));
  }
  for (const config::OutputConfig& wanted : reading.config.outputs) {
    if (wanted.avatar.empty()) continue;
    const auto figure = output::avatar_figure(wanted.avatar);
    if (!figure) reading.errors.push_back(figure.error());
  }
  for (const auto& endpoint : {reading.config.publish_endpoint, reading.config.control_endpoint}) {
    if (auto free = net::check_ipc_file(endpoint); !free) reading.errors.push_back(free.error());
  }
  if (auto models = control::ModelFolder::open(reading.config.models); !models) {
    reading.errors.push_back(models.error());
  }
  if (const auto& record = reading.config.record) {
    if (auto fine = config::check_folder(*record); !fine) {
      reading.errors.push_back(
          {.message = fine.error().message, .file = file, .line = record->line});
    }
  }
}

// Returns 0 if everything would run; 2 if the config is wrong; 1 if it is right, but a file or a
// device that it names cannot be used.
int check(const CheckOptions& options) {
  config::Reading reading = config::read_config_file(options.config, drivers::registry());
  std::vector<Findings> streams, sources, outputs, errors;
  if (reading.errors.empty()) try_all(options.config.string(), reading, streams, sources);
  const config::DaemonConfig& config = reading.config;
  for (const config::OutputConfig& output : config.outputs) outputs.push_back(findings_of(output));
  int exit_code = 0;
  for (const Error& error : reading.errors) {
    exit_code = std::max(exit_code, report(error));
    errors.push_back(
        Findings().add("file", error.file).add("line", error.line).add("message", error.message));
  }
  Findings findings;
  for (const auto& [name, address] : drivers::resolved_names()) {
    findings.say(fmt::format("{} is {}", name, address));
  }
  findings.add("ok", errors.empty())
      .add("publish", config.publish_endpoint)
      .add("control", config.control_endpoint)
      .say(fmt::format("publishes on {}, controlled on {} ({})", config.publish_endpoint,
                       config.control_endpoint, security_of(config)))
      .add("streams", streams)
      .add("sources", sources)
      .add("outputs", outputs);
  if (config.record) findings.add("record", findings_of(*config.record));
  if (config.trigger) findings.add("trigger", findings_of(*config.trigger));
  if (config.metrics) {
    findings.add("metrics", Findings().add("listen", config.metrics->listen))
        .say(fmt::format("metrics on http://{}/metrics", config.metrics->listen));
  }
  findings.add("errors", errors);
  if (options.json || errors.empty()) findings.show(options.json, -1);
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

}  // namespace posed::tools
