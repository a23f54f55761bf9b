#include "daemon/pipeline/stream_settings.hpp"

#include <algorithm>
#include <utility>

#include "daemon/pipeline/counters.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/parameter.hpp"

namespace posed::pipeline {
namespace {

StageContext context_of(const StreamSettings& settings, std::size_t stage,
                        std::shared_ptr<const Skeleton> skeleton) {
  StageContext context{.skeleton = std::move(skeleton),
                       .rate_hz = settings.rate_hz,
                       .parameters = settings.stages[stage].parameters};
  for (const PartnerStream& partner : settings.stages[stage].partners) {
    context.partners.push_back(partner.about);
  }
  return context;
}

// From which streams stage number `stage` of the engine gets frames.
void add_feeds(const StageSettings& settings, std::size_t stage, std::vector<PartnerFeed>& feeds) {
  for (std::size_t i = 0; i < settings.partners.size(); ++i) {
    const PartnerStream& partner = settings.partners[i];
    if (partner.stream != kNoStream) feeds.push_back({partner.stream, stage, i});
  }
}

// The skeleton of the frames that leave the first `stages` stages.
Result<std::shared_ptr<const Skeleton>> skeleton_before(const StreamSettings& settings,
                                                        std::size_t stages,
                                                        std::shared_ptr<const Skeleton> skeleton) {
  for (std::size_t i = 0; i < stages && skeleton; ++i) {
    if (settings.stages[i].type->leaves == nullptr) continue;
    skeleton = TRY(settings.stages[i].type->leaves(context_of(settings, i, std::move(skeleton))));
  }
  return skeleton;
}

}  // namespace

StageSettings stage_settings(const StageType& type, const Parameters& changed) {
  return {.type = &type, .parameters = complete_parameters(type.parameters, changed).value()};
}

std::vector<std::string> partner_names(const StageType& type, const Parameters& parameters) {
  std::vector<std::string> names;
  for (const std::string_view partner : type.partners) {
    names.push_back(parameter<std::string>(parameters, std::string(partner)));
  }
  return names;
}

Result<> find_partners(StreamSettings& settings, const PartnerStreams& known) {
  for (StageSettings& stage : settings.stages) {
    stage.partners.clear();
    for (const std::string& name : partner_names(*stage.type, stage.parameters)) {
      PartnerStream& partner = stage.partners.emplace_back();
      const auto found = name.empty() ? known.end() : known.find(name);
      if (found == known.end()) continue;
      if (!found->second.about.skeleton) {
        return misuse("stage " + std::string(stage.type->name) + " cannot have stream " +
                      in_quotes(name) + ", because that one has no poses, only samples");
      }
      partner = found->second;
    }
  }
  return {};
}

Result<StageContext> stage_context(const StreamSettings& settings, std::size_t stage,
                                   const std::shared_ptr<const Skeleton>& source) {
  auto skeleton = TRY(skeleton_before(settings, stage, source));
  return context_of(settings, stage, std::move(skeleton));
}

Result<std::shared_ptr<const Skeleton>> published_skeleton(
    const StreamSettings& settings, const std::shared_ptr<const Skeleton>& source) {
  return skeleton_before(settings, settings.stages.size(), source);
}

Result<EngineOptions> engine_options(std::uint32_t stream, const StreamSettings& settings,
                                     const std::shared_ptr<const Skeleton>& skeleton,
                                     std::span<const StageModel* const> models) {
  EngineOptions options{.stream = stream,
                        .stale_after_ns = nanoseconds(settings.stale_after_s),
                        .publish_raw = settings.publish_raw};
  std::size_t live = 0;
  std::size_t readings = 0;
  for (std::size_t i = 0; i < settings.stages.size(); ++i) {
    const StageType& type = *settings.stages[i].type;
    if (!skeleton) {
      return misuse("it has no poses, only samples, so stage " + std::string(type.name) +
                    " has nothing to work on");
    }
    if (type.check != nullptr) {
      const auto fault = type.check(settings.stages[i].parameters, models[i] != nullptr);
      if (fault) return misuse(fault->sentence);
    }
    const auto context = TRY(stage_context(settings, i, skeleton));
    auto stage = TRY(type.make(context, models[i]));
    options.stages.push_back({&type, std::move(stage)});
    add_feeds(settings.stages[i], i, options.feeds);
    live += static_cast<std::size_t>(std::ranges::count_if(
        type.parameters, [](const ParameterSpec& spec) { return spec.live && has_number(spec); }));
    readings += type.readings.size();
  }
  if (options.stages.size() > kMaxStages || live > kMaxLiveParameters || readings > kMaxReadings) {
    return misuse("a stream has at most " + std::to_string(kMaxStages) + " stages, with " +
                  std::to_string(kMaxLiveParameters) + " live parameters and " +
                  std::to_string(kMaxReadings) + " readings");
  }
  return options;
}

}  // namespace posed::pipeline
