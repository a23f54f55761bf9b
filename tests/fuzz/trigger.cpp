// Any datagram at the trigger: it is refused, or its name, made printable, is one that a take may
// have.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "daemon/control/trigger.hpp"
#include "posed/v1/posed.pb.h"

namespace {

class AnyTake final : public posed::control::DaemonControl {
 public:
  bool send(const posed::pipeline::Command&) override { return false; }
  bool send(const posed::pipeline::DeviceCommand&) override { return false; }
  void keep_model(std::span<const std::byte>) override {}
  void stages_changed(std::uint32_t, const posed::pipeline::StreamSettings&) override {}
  posed::Result<posed::pipeline::Take> mark_take(const posed::pipeline::TakeMark& mark) override {
    if (!posed::pipeline::check_take_name(mark.name)) std::abort();
    if (mark.timecode.size() > 12) std::abort();
    return posed::pipeline::Take{.number = 1, .name = mark.name};
  }
  void fill(posed::v1::Stats&) override {}
  void stop() override {}
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  AnyTake daemon;
  posed::control::Trigger trigger(daemon, []() noexcept { return std::int64_t{1}; });
  const std::string_view datagram(reinterpret_cast<const char*>(data), size);
  trigger.handle(datagram, "127.0.0.1");
  if (trigger.marked() + trigger.refused() != 1) std::abort();
  return 0;
}
