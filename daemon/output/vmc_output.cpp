#include "daemon/output/vmc_output.hpp"

#include <string>
#include <utility>

#include "models/motion/canonical_skeleton.hpp"
#include "proto/clip/clip.hpp"
#include "proto/text/clean.hpp"

namespace posed::output {
namespace {

namespace vmc = drivers::vmc;

// A part that has been silent for longer no longer leads.
constexpr std::int64_t kLeads_ns = kNanosPerSecond / 4;

// The humanoid with the avatar's bones, as its file rests.
Result<std::shared_ptr<const Skeleton>> avatar_figure(const std::filesystem::path& path) {
  const auto clip = TRY(clip::read_clip(path));
  auto figure = motion::canonical_skeleton(*clip.skeleton);
  if (!figure) return fail("has no humanoid: " + figure.error().message, path.string());
  return figure;
}

}  // namespace

Result<std::unique_ptr<Output>> VmcOutput::open(const config::OutputConfig& config,
                                                std::unique_ptr<system::EventFd> wake) {
  std::shared_ptr<const Skeleton> figure;
  if (!config.avatar.empty()) figure = TRY(avatar_figure(config.avatar));
  auto receivers = TRY(UdpReceivers::open(config.to));
  return std::make_unique<VmcOutput>(config, std::move(wake), std::move(figure),
                                     std::move(receivers));
}

VmcOutput::VmcOutput(const config::OutputConfig& config, std::unique_ptr<system::EventFd> wake,
                     std::shared_ptr<const Skeleton> figure, UdpReceivers receivers)
    : Output(config, std::move(wake)),
      assistant_(config.assistant),
      avatar_(config.assistant, std::move(figure)),
      shapes_(config.vrm1_names ? VrmNames::kVrm1 : VrmNames::kVrm0),
      receivers_(std::move(receivers)),
      writer_(std::make_unique<vmc::DatagramWriter>(vmc::Packing::kBundles)) {
  measured_ns_.fill(kNoTime_ns);
  set_receivers(receivers_.size());
}

Result<> VmcOutput::set_stream(std::size_t place, const LiveStream* stream) {
  const auto part = static_cast<Part>(place);
  measured_ns_[place] = kNoTime_ns;
  if (part == Part::kBody) {
    const std::size_t left_out =
        shapes_.set_layout(stream != nullptr ? stream->samples : drivers::SampleLayout{});
    if (left_out > 0) {
      notify(std::to_string(left_out) + " blend shapes of stream " + in_quotes(stream->name) +
             " are left out: their names are too long for a frame");
    }
  }
  const auto set = avatar_.set_skeleton(part, stream != nullptr ? stream->skeleton : nullptr);
  if (!set) {
    return fail("cannot move its " + std::string(words_for(part)) + ": " + set.error().message);
  }
  return {};
}

void VmcOutput::begin_turn(std::int64_t now_ns) {
  if (begin_ns_ == kNoTime_ns) begin_ns_ = now_ns;
  if (sample() && !assistant_) shapes_.update(*sample());
}

std::int64_t VmcOutput::end_turn(std::int64_t now_ns) {
  for (const std::string& news : receivers_.drain_news(now_ns)) notify(news);
  return system::kForever_ns;
}

bool VmcOutput::leads(Part part, std::int64_t now_ns) const noexcept {
  for (const Part before : kAllParts) {
    if (before == part) return true;
    const std::int64_t measured_ns = measured_ns_[index_of(before)];
    if (measured_ns != kNoTime_ns && now_ns < measured_ns + kLeads_ns) return false;
  }
  return true;
}

// The frame goes into the avatar.
bool VmcOutput::take(std::size_t place, const Frame& frame, std::int64_t now_ns) {
  const auto part = static_cast<Part>(place);
  if (!avatar_.set_pose(part, frame)) return false;
  if (frame.quality != Quality::kStale) measured_ns_[place] = now_ns;
  if (!leads(part, now_ns)) return false;
  quality_ = frame.quality;
  return true;
}

void VmcOutput::send(std::int64_t now_ns) {
  writer_->start();
  avatar_.write(*writer_);
  if (!assistant_) shapes_.write(*writer_);
  if (quality_ == Quality::kStale || quality_ == Quality::kHeld) {
    writer_->status({.tracking = false});
  } else {
    writer_->loaded();
  }
  writer_->time(static_cast<float>(seconds(now_ns - begin_ns_)));
  for (std::size_t i = 0; i < writer_->datagrams(); ++i) {
    count(receivers_.send(writer_->datagram(i), now_ns));
  }
}

}  // namespace posed::output
