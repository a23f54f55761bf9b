#include "daemon/config/config_file.hpp"

#include <algorithm>
#include <map>

#include <spdlog/fmt/fmt.h>

#include "models/stages/registry.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/list.hpp"

namespace posed::config {
namespace {

constexpr Range kStaleAfter{0.01, 3600.0};

std::vector<const StageType*> read_order(TableReader& table) {
  std::vector<std::string> names;
  table.read("stages", names);
  std::vector<const StageType*> order;
  for (const std::string& name : names) {
    const StageType* type = find_stage_type(name);
    if (type == nullptr) {
      const std::string known = joined(stage_types(), ", ", &StageType::name);
      table.add_error("stages",
                      fmt::format("there is no stage {}; there is: {}", in_quotes(name), known));
    } else if (std::ranges::find(order, type) != order.end()) {
      table.add_error("stages",
                      fmt::format("{} is in the list twice; a stream has each stage once", name));
    } else {
      order.push_back(type);
    }
  }
  return order;
}

// Returns false if the table switches the stage off.
bool read_stage(TableReader& table, const ConfigFile& file, StageConfig& stage) {
  const StageType& type = *stage.type;
  bool enabled = true;
  table.read("enabled", enabled);
  std::string model;
  if (type.model_required && enabled) {
    table.require("model", model);
  } else if (type.has_model()) {
    table.read("model", model);
  }
  stage.model = file.resolve(model);
  for (const ParameterSpec& spec : type.parameters) {
    ParameterValue value = spec.default_value;
    file.read_parameter(table, spec, value);
    if (spec.required && enabled && !table.has(spec.shown_name())) {
      table.add_error(spec.shown_name(), fmt::format("{}.{} is missing: {}", table.path(),
                                                     spec.shown_name(), spec.help));
    }
    stage.parameters.emplace(spec.name, std::move(value));
  }
  for (const std::string_view name : type.partners) {
    stage.partner_lines.push_back(table.has(name) ? table.line_of(name) : 0);
  }
  if (type.check != nullptr && enabled) {
    const auto fault = type.check(stage.parameters, !model.empty());
    if (fault) table.add_error(fault->parameter, fault->sentence);
  }
  table.finish();
  return enabled;
}

// A stage that needs the source's pose cannot stand behind one that has lost it.
void check_order(TableReader& table, const std::vector<StageConfig>& stages) {
  std::string_view loses;
  for (const StageConfig& stage : stages) {
    if (stage.type->needs_input && !loses.empty()) {
      table.add_error("stages", fmt::format("{0} needs the pose as the source gave it, which {1}"
                                            " does not hand on; put {0} before {1}",
                                            stage.type->name, loses));
    }
    if (stage.type->input == StageInput::kLoses) loses = stage.type->name;
    if (stage.type->input == StageInput::kRenews) loses = {};
  }
}

// The stages of a stream: one for each of their tables, in the order of the registry or in that of
// `stages = [...]`.
void read_stages(TableReader& table, const ConfigFile& file, StreamConfig& stream) {
  std::map<const StageType*, StageConfig> present;
  for (const StageType* type : stage_types()) {
    auto stage_table = table.table(std::string(type->name));
    if (!stage_table) continue;
    StageConfig stage{.type = type};
    if (read_stage(*stage_table, file, stage)) {
      present.emplace(type, std::move(stage));
    } else {
      stream.off.push_back(type);
    }
  }
  stream.default_stages = !table.has("stages");
  const std::size_t errors = file.findings.errors.size();
  std::vector<const StageType*> order = read_order(table);
  if (file.findings.errors.size() > errors) return;
  if (stream.default_stages) order.assign(stage_types().begin(), stage_types().end());
  for (const StageType* type : order) {
    auto found = present.extract(type);
    if (!found.empty()) {
      stream.stages.push_back(std::move(found.mapped()));
    } else if (!stream.default_stages && std::ranges::find(stream.off, type) == stream.off.end()) {
      auto parameters = complete_parameters(type->parameters, {});
      if (type->model_required) {
        table.add_error("stages", fmt::format("stage {0} needs a model; add a [{1}.{0}] table"
                                              " with model = \"FILE\"",
                                              type->name, table.path()));
      } else if (!parameters) {
        table.add_error("stages", fmt::format("stage {0} needs a [{1}.{0}] table: {2}", type->name,
                                              table.path(), parameters.error().message));
      } else {
        stream.stages.push_back({.type = type, .parameters = std::move(*parameters)});
      }
    }
  }
  check_order(table, stream.stages);
  for (const StageType* type : stage_types()) {
    if (!present.contains(type)) continue;
    table.add_error("stages", fmt::format("[{1}.{0}] is there, but {0} is not in this list; add"
                                          " it, or leave out its table",
                                          type->name, table.path()));
  }
}

}  // namespace

void read_settings(TableReader& table, const ConfigFile& file, StreamConfig& stream) {
  table.read("publish_raw", stream.publish_raw);
  table.read("stale_after_s", stream.stale_after_s, kStaleAfter);
  read_stages(table, file, stream);
}

}  // namespace posed::config
