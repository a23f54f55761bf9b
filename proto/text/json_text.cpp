#include "proto/text/json_text.hpp"

#include <nlohmann/json.hpp>

namespace posed {

std::string json_text(const nlohmann::json& value, int indent) {
  return clean_json(value.dump(indent, ' ', false, nlohmann::json::error_handler_t::replace));
}

std::string json_text(const nlohmann::ordered_json& value, int indent) {
  return clean_json(
      value.dump(indent, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
}

nlohmann::json parse_json(std::string_view text) {
  using Json = nlohmann::json;
  if (text.size() > kMaxJson) return Json::value_t::discarded;
  bool flat = true;
  const auto is_flat = [&](int depth, Json::parse_event_t, const Json&) {
    flat = flat && depth <= kMaxJsonDepth;
    return flat;
  };
  Json value = Json::parse(text, is_flat, false);
  return flat ? value : Json(Json::value_t::discarded);
}

}  // namespace posed
