#include "daemon/devices/source_builder.hpp"

#include <algorithm>
#include <utility>

#include "daemon/system/clock.hpp"

namespace posed::devices {

SourceBuilder::SourceBuilder(std::vector<std::unique_ptr<BodySource>>& sources, StreamSlots slots,
                             std::set<std::string> reserved, ModelFiles& models,
                             const pipeline::PartnerStreams& partners, StreamHost& host)
    : shared_{.host = host,
              .slots = std::move(slots),
              .names = BodyNames(std::move(reserved)),
              .models = models,
              .partners = partners} {
  for (const auto& source : sources) {
    sources_.push_back(std::make_unique<SourceBodies>(shared_, *source));
  }
}

std::int64_t SourceBuilder::turn(std::int64_t now_ns) {
  while (const auto id = shared_.host.take_gone()) {
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
