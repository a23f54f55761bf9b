#include "daemon/record/stream_settings.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include <nlohmann/json.hpp>

#include "models/stages/registry.hpp"
#include "proto/text/json_text.hpp"

namespace posed::record {

namespace {

using Json = nlohmann::ordered_json;
using pipeline::StageSettings;

constexpr const char* kMapping = "skeleton mapping";  // no option has a blank in its name

Json to_json_value(const ParameterValue& value) {
  return std::visit([](const auto& it) { return Json(it); }, value);
}

ParameterValue from_json_value(const Json& value) {
  if (value.is_boolean()) return value.get<bool>();
  if (value.is_number_integer()) return value.get<std::int64_t>();
  if (value.is_number()) return value.get<double>();
  return value.get<std::string>();
}

Json to_json(const StageSettings& stage) {
  Json json{{"stage", stage.type->name}};
  if (stage.type->has_model()) {
    json["model"] = stage.model_sha256;
    json["model_name"] = stage.model_name;
  }
  // Ids of streams; null where a partner is not named or was not there.
  for (const pipeline::PartnerStream& partner : stage.partners) {
    const bool there = partner.stream != pipeline::kNoStream;
    json["partners"].push_back(there ? Json(partner.stream) : Json());
  }
  Json& parameters = json["parameters"] = Json::object();
  for (const ParameterSpec& spec : stage.type->parameters) {
    const std::string name(spec.name);
    parameters[name] = to_json_value(stage.parameters.at(name));
  }
  return json;
}

// Empty if this version of posed does not have the stage, or cannot run it so.
std::optional<StageSettings> stage_of(const Json& json) {
  const StageType* type = find_stage_type(json.at("stage").get<std::string>());
  if (type == nullptr) return std::nullopt;
  Parameters given;
  for (const auto& [name, value] : json.at("parameters").items()) {
    // Development versions wrote flags that have gone since; one that was off changes nothing.
    if (find_parameter(type->parameters, name) == nullptr && value == false) continue;
    given.emplace(name, from_json_value(value));
  }
  auto parameters = complete_parameters(type->parameters, given);
  if (!parameters) return std::nullopt;
  std::vector<pipeline::PartnerStream> partners;
  for (const Json& partner : json.value("partners", Json::array())) {
    partners.push_back(
        {.stream = partner.is_null() ? pipeline::kNoStream : partner.get<std::uint32_t>()});
  }
  if (!partners.empty() && partners.size() != type->partners.size()) return std::nullopt;
  return StageSettings{.type = type,
                       .parameters = std::move(*parameters),
                       .partners = std::move(partners),
                       .model_sha256 = json.value("model", ""),
                       .model_name = json.value("model_name", "")};
}

bool valid(const StreamSettings& settings) {
  constexpr double kMaxSetting = 1e6;  // s, Hz: far beyond sense, far below overflow
  return settings.stale_after_s > 0.0 && settings.stale_after_s <= kMaxSetting &&
         settings.rate_hz >= 0.0 && settings.rate_hz <= kMaxSetting;
}

}  // namespace

std::string to_json(const StreamSettings& settings) {
  Json stages = Json::array();
  for (const StageSettings& stage : settings.stages) stages.push_back(to_json(stage));
  return json_text(Json{{"publish_raw", settings.publish_raw},
                        {"stale_after_s", settings.stale_after_s},
                        {"rate_hz", settings.rate_hz},
                        {"stages", std::move(stages)}});
}

Result<StreamSettings> settings_from_json(const std::string& json, const std::string& file) {
  try {
    const Json root(parse_json(json));
    if (root.is_discarded())
      return fail("the log is damaged (a stream's settings are no JSON)", file);
    StreamSettings settings;
    settings.publish_raw = root.at("publish_raw").get<bool>();
    settings.stale_after_s = root.at("stale_after_s").get<double>();
    settings.rate_hz = root.at("rate_hz").get<double>();
    for (const Json& stage : root.at("stages")) {
      auto read = stage_of(stage);
      const bool twice = read && std::ranges::find(settings.stages, read->type,
                                                   &StageSettings::type) != settings.stages.end();
      if (!read || twice) {
        return fail("this posed cannot run the stages of a stream as recorded in the log (" +
                        json_text(stage.at("stage")) + "); update posed",
                    file);
      }
      settings.stages.push_back(std::move(*read));
    }
    if (!valid(settings)) return fail("the log is damaged (a stream's settings are invalid)", file);
    return settings;
  } catch (const nlohmann::json::exception& error) {
    return fail("the log is damaged (a stream's settings: " + std::string(error.what()) + ")",
                file);
  }
}

std::string to_json(const drivers::Options& options, const std::string& mapping) {
  Json json = Json::object();
  for (const auto& [name, value] : options) {
    json[name] = to_json_value(value);
  }
  if (!mapping.empty()) json[kMapping] = mapping;
  return json_text(json);
}

Result<std::string> mapping_from_json(const std::string& json, const std::string& file) {
  const Json root(parse_json(json));
  const auto found = root.find(kMapping);
  if (found == root.end()) return std::string();
  if (found->is_string()) return found->get<std::string>();
  return fail("the log is damaged (a source's mapping is no text); use another copy of it", file);
}

}  // namespace posed::record
