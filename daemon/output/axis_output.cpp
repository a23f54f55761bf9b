#include "daemon/output/axis_output.hpp"

#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace posed::output {

Result<std::unique_ptr<Output>> AxisOutput::open(const config::OutputConfig& config,
                                                 std::unique_ptr<system::EventFd> wake) {
  if (!config.to.empty()) {
    auto receivers = TRY(UdpReceivers::open(config.to));
    return std::make_unique<AxisOutput>(config, std::move(wake), std::nullopt,
                                        std::move(receivers));
  }
  auto clients = TRY(LineClients::open(config.listen, config.peers));
  return std::make_unique<AxisOutput>(config, std::move(wake), std::move(clients), std::nullopt);
}

AxisOutput::AxisOutput(const config::OutputConfig& config, std::unique_ptr<system::EventFd> wake,
                       std::optional<LineClients> clients, std::optional<UdpReceivers> receivers)
    : Output(config, std::move(wake)),
      header_(config.header),
      binary_(config.binary),
      clients_(std::move(clients)),
      receivers_(std::move(receivers)),
      people_(config.people()) {}

Result<> AxisOutput::set_stream(std::size_t place, const LiveStream* stream) {
  Person& person = people_[place];
  person.figure.reset();
  person.waits = false;
  if (stream == nullptr) return {};
  auto figure = AxisFigure::make(stream->skeleton, static_cast<std::uint8_t>(place), stream->name);
  if (!figure) return fail("cannot be sent: " + figure.error().message);
  person.figure = std::make_unique<AxisFigure>(std::move(*figure));
  if (header_) clients_->set_greeting(person.figure->hierarchy());
  return {};
}

void AxisOutput::begin_turn(std::int64_t now_ns) {
  if (look_ns_ != kNoTime_ns && now_ns < look_ns_) return;
  for (const std::string& news :
       clients_ ? clients_->look(now_ns) : receivers_->drain_news(now_ns)) {
    notify(news);
  }
  look_ns_ = now_ns + LineClients::kLook_ns;
}

bool AxisOutput::take(std::size_t place, const Frame& frame, std::int64_t /*now_ns*/) {
  Person& person = people_[place];
  if (person.figure == nullptr) return false;
  person.frame = frame;
  person.waits = true;
  return true;
}

void AxisOutput::send(std::int64_t now_ns) {
  for (Person& person : people_) {
    if (!std::exchange(person.waits, false) || (clients_ && clients_->size() == 0)) continue;
    AxisFigure& figure = *person.figure;
    const std::string_view message =
        binary_ ? figure.message(person.frame) : figure.line(person.frame);
    count(clients_ ? clients_->send(message, now_ns)
                   : receivers_->send(std::as_bytes(std::span(message)), now_ns));
  }
}

std::int64_t AxisOutput::end_turn(std::int64_t /*now_ns*/) {
  set_receivers(clients_ ? clients_->size() : receivers_->size());
  return look_ns_;
}

}  // namespace posed::output
