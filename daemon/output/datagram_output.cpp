#include "daemon/output/datagram_output.hpp"

#include <string>
#include <utility>

namespace posed::output {
namespace {

std::unique_ptr<DatagramEncoder> encoder_of(const config::OutputConfig& config) {
  switch (config.kind) {
    case config::OutputKind::kMocopi:
      return mocopi_encoder();
    case config::OutputKind::kRokoko:
      return rokoko_encoder(config);
    default:
      return mvn_encoder(config);
  }
}

}  // namespace

Result<std::unique_ptr<Output>> DatagramOutput::open(const config::OutputConfig& config,
                                                     std::unique_ptr<system::EventFd> wake) {
  auto receivers = TRY(UdpReceivers::open(config.to));
  return std::make_unique<DatagramOutput>(config, std::move(wake), encoder_of(config),
                                          std::move(receivers));
}

DatagramOutput::DatagramOutput(const config::OutputConfig& config,
                               std::unique_ptr<system::EventFd> wake,
                               std::unique_ptr<DatagramEncoder> encoder, UdpReceivers receivers)
    : Output(config, std::move(wake), config.kind == config::OutputKind::kRokoko),
      places_(config.people()),
      encoder_(std::move(encoder)),
      receivers_(std::move(receivers)) {
  set_receivers(receivers_.size());
}

Result<> DatagramOutput::set_stream(std::size_t place, const LiveStream* stream) {
  described_ns_ = kNoTime_ns;
  const auto set = encoder_->set_person(place, stream);
  if (!set) return fail("cannot be sent: " + set.error().message);
  return {};
}

// A sample may come without a frame of its stream.
void DatagramOutput::begin_turn(std::int64_t /*now_ns*/) {
  for (std::size_t place = 0; place < places_; ++place) {
    if (sample(place)) encoder_->take_sample(place, *sample(place));
  }
}

bool DatagramOutput::take(std::size_t place, const Frame& frame, std::int64_t /*now_ns*/) {
  return encoder_->take(place, frame);
}

void DatagramOutput::send(std::int64_t now_ns) {
  const SendDatagram send = [this](std::span<const std::byte> datagram) {
    datagrams_.add(datagram);
  };
  if (described_ns_ == kNoTime_ns || now_ns >= described_ns_ + encoder_->describe_every_ns()) {
    described_ns_ = now_ns;
    encoder_->describe(send);
  }
  encoder_->encode(send);
}

std::int64_t DatagramOutput::end_turn(std::int64_t now_ns) {
  count(receivers_.send(datagrams_, now_ns));
  for (const News& news : receivers_.drain_news(now_ns)) notify(news);
  return system::kForever_ns;
}

}  // namespace posed::output
