#include "daemon/record/replay_models.hpp"

#include <utility>

#include "models/gesture/model_file.hpp"
#include "models/style/style_model.hpp"

namespace posed::record {
namespace {

std::string name_of(const std::string& hash) { return "the log's model " + hash.substr(0, 12); }

}  // namespace

Result<> ReplayModels::load_style(const log::Reader& reader, const std::string& hash,
                                  const drivers::Description& description,
                                  const style::FilterOptions& options) {
  if (styles_.contains(hash)) return {};
  const auto bytes = reader.blob(hash);
  if (!bytes) return std::unexpected(bytes.error());
  const auto model = style::parse_model(*bytes, name_of(hash));
  if (!model) return std::unexpected(model.error());
  for (auto& copy : styles_[hash]) {
    auto bound = style::bind_model(*model, *description.skeleton, options, name_of(hash));
    if (!bound) return std::unexpected(bound.error());
    copy = std::move(*bound);
  }
  return {};
}

Result<> ReplayModels::load_gesture(const log::Reader& reader, const std::string& hash,
                                    const drivers::Description& description) {
  if (gestures_.contains(hash)) return {};
  const auto bytes = reader.blob(hash);
  if (!bytes) return std::unexpected(bytes.error());
  auto model = gesture::parse_model(*bytes, name_of(hash));
  if (!model) return std::unexpected(model.error());
  auto bound = generate::bind_model(std::move(*model), *description.skeleton, description.rate_hz,
                                    name_of(hash));
  if (!bound) return std::unexpected(bound.error());
  gestures_[hash] = std::move(*bound);
  return {};
}

const style::BoundModel* ReplayModels::style(const std::string& hash,
                                             const style::BoundModel* current) const {
  const auto found = styles_.find(hash);
  if (found == styles_.end()) return nullptr;
  const auto& [one, other] = found->second;
  return current == one.get() ? other.get() : one.get();
}

const generate::BoundModel* ReplayModels::gesture(const std::string& hash) const {
  const auto found = gestures_.find(hash);
  return found == gestures_.end() ? nullptr : found->second.get();
}

}  // namespace posed::record
