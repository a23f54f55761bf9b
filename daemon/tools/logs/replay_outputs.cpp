#include "daemon/tools/logs/replay_outputs.hpp"

#include "models/gp/isa.hpp"
#include "proto/text/stream_name.hpp"

namespace posed::tools {

ReplayOutputs::ReplayOutputs(const replay::Replay& replay) : replay_(replay) {
  for (std::uint32_t id = 0; id < replay.streams(); ++id) {
    const std::string& name = replay.stream(id).name;
    encoders_.push_back({message::FrameEncoder(name), message::FrameEncoder(raw_name(name))});
  }
}

void ReplayOutputs::take(const pipeline::Item& item) {
  if (broadcast) broadcast->add(item);
  const bool raw = item.kind == pipeline::Item::Kind::kRawFrame;
  if (!raw && item.kind != pipeline::Item::Kind::kFrame) return;
  ++frames;
  if (raw) ++raw_frames;
  const std::uint32_t stream = item.frame.header.stream;
  const v1::Frame& frame = encoders_[stream][raw].encode(item.frame);
  if (file) file->add(frame);
  if (!expectation || difference) return;
  auto same = expectation->compare(stream, raw, frame, replay_.broken_at(stream));
  if (!same) difference = same.error();
}

Result<> ReplayOutputs::finish() {
  if (file) {
    if (auto closed = file->close(); !closed) return closed;
  }
  for (std::uint32_t id = 0; expectation && !difference && id < encoders_.size(); ++id) {
    auto same = expectation->finish(id, replay_.broken_at(id));
    if (!same) difference = same.error();
  }
  if (difference) return std::unexpected(*difference);
  return expectation ? expectation->check_compared() : Result<>{};
}

std::string recorded_isa(const log::Reader& reader) {
  const auto meta = reader.meta().find("isa");
  return meta == reader.meta().end() ? "auto" : meta->second;
}

Result<> set_isa_or(const std::string& wanted, const std::string& recorded) {
  if (!wanted.empty()) return gp::set_isa(wanted);
  if (gp::set_isa(recorded)) return {};
  return gp::set_isa("auto");
}

}  // namespace posed::tools
