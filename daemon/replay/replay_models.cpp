#include "daemon/replay/replay_models.hpp"

#include <utility>

#include "models/gesture/model_file.hpp"

namespace posed::replay {
namespace {

std::string name_of(const std::string& hash) { return "the log's model " + hash.substr(0, 12); }

// The model stored under a hash; reads it at its first use.
template <typename Model, typename Parse>
Result<const Model*> find_or_read(std::map<std::string, Model>& models, const std::string& hash,
                                  const log::Reader& reader, Parse&& parse) {
  if (const auto found = models.find(hash); found != models.end()) return &found->second;
  const auto bytes = reader.blob(hash);
  if (!bytes) return std::unexpected(bytes.error());
  auto model = parse(*bytes, name_of(hash));
  if (!model) return std::unexpected(model.error());
  return &models.emplace(hash, std::move(*model)).first->second;
}

}  // namespace

Result<std::unique_ptr<const style::BoundModel>> ReplayModels::style(
    const std::string& hash, const drivers::Description& device,
    const style::FilterOptions& options) {
  const auto model = find_or_read(styles_, hash, reader_, style::parse_model);
  if (!model) return std::unexpected(model.error());
  return style::bind_model(**model, *device.skeleton, options, name_of(hash));
}

Result<std::unique_ptr<const generate::BoundModel>> ReplayModels::gesture(
    const std::string& hash, const drivers::Description& device) {
  const auto model = find_or_read(gestures_, hash, reader_, gesture::parse_model);
  if (!model) return std::unexpected(model.error());
  return generate::bind_model(**model, *device.skeleton, device.rate_hz, name_of(hash));
}

}  // namespace posed::replay
