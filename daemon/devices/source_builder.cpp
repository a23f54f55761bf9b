#include "daemon/devices/source_builder.hpp"

#include <algorithm>
#include <utility>

#include "daemon/devices/about_stream.hpp"

namespace posed::devices {
namespace {

// Streams that the config names.
std::size_t count_named(const std::vector<std::unique_ptr<OpenSource>>& sources) {
  std::size_t named = 0;
  for (const auto& source : sources) named += source->config.named.size();
  return named;
}

}  // namespace

SourceBuilder::SourceBuilder(std::vector<std::unique_ptr<OpenSource>>& sources, std::uint32_t slots,
                             std::set<std::string> reserved, ModelFiles& models,
                             const KeptSettings& kept, StreamHost& host, std::size_t max_made)
    : shared_{.host = host,
              .slots = StreamSlots(slots, count_named(sources)),
              .names = BodyNames(std::move(reserved)),
              .models = models,
              .kept = kept,
              .max_made = max_made} {
  for (const auto& source : sources) {
    ++(source->has_several() ? shared_.several : shared_.single);
    sources_.push_back(std::make_unique<SourceBodies>(shared_, *source));
    if (source->has_several()) continue;
    only_.push_back(sources_.back().get());
    only_configs_.push_back(&source->config.named[0].stream);
  }
}

Result<> SourceBuilder::open() {
  for (SourceBodies* const source : only_) source->reserve_only();
  for (const std::size_t i : building_order(only_configs_)) {
    if (auto built = only_[i]->build_only(); !built) {
      return in_stream(only_configs_[i]->name, built.error());
    }
  }
  return {};
}

void SourceBuilder::begin() {
  for (SourceBodies* const source : only_) source->add_only();
}

std::int64_t SourceBuilder::turn(std::int64_t now_ns) {
  while (const auto id = shared_.host.next_gone()) {
    for (const auto& source : sources_) {
      if (source->gone(*id)) break;
    }
  }
  for (const auto& source : sources_) source->turn(now_ns);
  // Afterwards, because a source may have freed the slot that another waits for.
  std::int64_t due_ns = system::kForever_ns;
  for (const auto& source : sources_) due_ns = std::min(due_ns, source->due_ns(now_ns));
  return due_ns;
}

}  // namespace posed::devices
