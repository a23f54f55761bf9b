// What the pipeline assumes about any command that control lets through.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

#include "daemon/control/request_handler.hpp"
#include "daemon/pipeline/messages.hpp"
#include "posed/v1/posed.pb.h"
#include "tests/fuzz/demand.hpp"
#include "tests/support/stage_commands.hpp"

namespace posed::fuzz {

inline void check_command(const pipeline::Command& command) {
  const pipeline::StageChange& change = command.change;
  if (change.type == nullptr) std::abort();
  if (change.kind == pipeline::StageChange::Kind::kCommand) {
    if (change.index >= change.type->commands.size()) std::abort();
  } else if (change.kind == pipeline::StageChange::Kind::kSet) {
    if (change.index >= change.type->parameters.size()) std::abort();
    const ParameterSpec& spec = change.type->parameters[change.index];
    if (!spec.live || !takes_number(spec, change.value)) std::abort();
  } else if (command.model == nullptr) {
    std::abort();
  }
}

// A daemon of `streams` streams that checks what it is sent and says that it was done. Stream 1
// alone plays.
class CheckingControl final : public control::DaemonControl {
 public:
  explicit CheckingControl(std::uint32_t streams) : streams_(streams) {}

  bool send(const pipeline::Command& command) override {
    check_command(command);
    if (command.change.kind == pipeline::StageChange::Kind::kCommand &&
        command.change.index == generate::GenerateStage::kPlay) {
      const auto play = command.command.as<gesture::PlayOrder>();
      demand(command.stream == 1 && play.size > 0 && play.size <= play.label.size());
      demand(play.tempo >= 0.5F && play.tempo <= 2.0F);
    }
    acks.push_back({.ticket = command.ticket, .stream = command.stream, .sequence = 1});
    return true;
  }
  bool send(const pipeline::DeviceCommand& command) override {
    demand(command.size <= command.bytes.size());
    if (command.ticket != 0) {
      acks.push_back({.ticket = command.ticket, .stream = command.source, .sequence = 1});
    }
    return true;
  }
  void keep_model(std::span<const std::byte>) override {}
  void stages_changed(std::uint32_t stream, const pipeline::StreamSettings&) override {
    demand(stream < streams_);
  }
  Result<pipeline::Take> mark_take(const pipeline::TakeMark& mark) override {
    demand(pipeline::check_take_name(mark.name).has_value());
    return pipeline::Take{.number = 1, .name = mark.name};
  }
  void fill(v1::Stats& stats) override { stats.set_rss_bytes(1); }
  void stop() override {}

  std::vector<pipeline::Ack> acks;

 private:
  std::uint32_t streams_;
};

}  // namespace posed::fuzz
