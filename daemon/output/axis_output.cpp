#include "daemon/output/axis_output.hpp"

#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "proto/text/clean.hpp"

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
      limit_(config.rate_hz),
      clients_(std::move(clients)),
      receivers_(std::move(receivers)) {}

std::int64_t AxisOutput::turn(std::int64_t now_ns) {
  const Delivery& delivery = receive();
  update_stream(delivery.streams[index_of(Part::kBody)]);
  if (look_ns_ == kNoTime_ns || now_ns >= look_ns_) {
    for (const std::string& news :
         clients_ ? clients_->look(now_ns) : receivers_->drain_news(now_ns)) {
      notify(news);
    }
    look_ns_ = now_ns + LineClients::kLook_ns;
  }
  const Frame* newest = nullptr;
  delivery.for_each([&](Part /*part*/, const Frame& frame) {
    newest = &frame;
    if (!limit_.limits()) send(frame, now_ns);
  });
  if (limit_.limits() && newest != nullptr && limit_.admit(now_ns)) send(*newest, now_ns);
  set_receivers(clients_ ? clients_->size() : receivers_->size());
  return look_ns_;
}

void AxisOutput::send(const Frame& frame, std::int64_t now_ns) {
  if (figure_ == nullptr || (clients_ && clients_->size() == 0)) return;
  const std::string_view message = binary_ ? figure_->message(frame) : figure_->line(frame);
  count(clients_ ? clients_->send(message, now_ns)
                 : receivers_->send(std::as_bytes(std::span(message)), now_ns));
}

void AxisOutput::update_stream(const std::shared_ptr<const PartStream>& stream) {
  if (known_ == stream) return;
  known_ = stream;
  figure_.reset();
  if (stream == nullptr) return;
  if (stream->skeleton == nullptr)
    return notify("stream " + in_quotes(stream->name) + " has no pose");
  auto figure = AxisFigure::make(stream->skeleton, stream->name);
  if (!figure) {
    return notify("stream " + in_quotes(stream->name) +
                  " cannot be sent: " + figure.error().message);
  }
  figure_ = std::make_unique<AxisFigure>(std::move(*figure));
  if (header_) clients_->set_greeting(figure_->hierarchy());
}

}  // namespace posed::output
