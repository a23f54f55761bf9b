// Any bytes as a control message, models included: an answer with a sentence, or a command that is
// well formed; nothing crashes, hangs or leaks.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "daemon/control/request_handler.hpp"
#include "posed/v1/control.pb.h"
#include "tests/unit/models/toy_style.hpp"

namespace {

using namespace posed;

class Helm final : public control::Helm {
 public:
  bool send(const pipeline::Command& command) override {
    if (!(std::abs(command.alpha) <= 2.0F)) std::abort();
    acks.push_back({.ticket = command.ticket, .stream = command.stream, .sequence = 1});
    return true;
  }
  void keep_model(std::span<const std::byte>) override {}
  void model_in_use(std::uint32_t stream, const std::string&) override {
    if (stream != 0) std::abort();
  }
  void fill(v1::Stats& stats) override { stats.set_rss_bytes(1); }
  void stop() override {}

  std::vector<pipeline::Ack> acks;
};

std::vector<control::ControlledStream> one_stream() {
  std::vector<control::ControlledStream> streams(1);
  streams[0].name = "w";
  streams[0].skeleton = std::make_shared<const Skeleton>(test::toy_skeleton());
  streams[0].style.emplace();
  return streams;
}

void check(const control::Answer& answer) {
  v1::ControlReply reply;
  if (!reply.ParseFromString(answer.bytes)) std::abort();
  if (!reply.ok() && reply.error().empty()) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static Helm helm;
  static control::RequestHandler handler(one_stream(), helm);
  if (const auto answer = handler.handle({}, std::as_bytes(std::span(data, size)))) check(*answer);
  for (const pipeline::Ack& ack : std::exchange(helm.acks, {})) {
    const auto answer = handler.acknowledge(ack);
    if (!answer) std::abort();
    check(*answer);
  }
  return 0;
}
