#include "drivers/transport/transport_factory.hpp"

#include <poll.h>
#include <unistd.h>

namespace posed::drivers {

TransportFactory::~TransportFactory() {
  for (const auto& [endpoint, listener] : listeners_) ::close(listener.fd);
}

Result<std::unique_ptr<UdpTransport>> TransportFactory::udp(const UdpSettings& settings) {
  TRY(check_udp(settings));
  if (only_prepare_) return not_opened();
  return UdpTransport::open(settings);
}

Result<std::unique_ptr<SubscriptionTransport>> TransportFactory::subscribe(
    const SubscriptionSettings& settings) {
  TRY(check_subscription(settings));
  if (only_prepare_) return not_opened();
  await_pause();
  subscriptions_ = TRY(subscription_context());
  return SubscriptionTransport::open(settings, *cancel_, subscriptions_, paused_);
}

void TransportFactory::await_pause() const noexcept {
  if (!paused_->have(PausedHosts::kOurs)) return;
  pollfd wake{.fd = cancel_->fd(), .events = POLLIN, .revents = 0};
  ::poll(&wake, 1, static_cast<int>(std::chrono::milliseconds(PausedHosts::kPause).count()));
}

}  // namespace posed::drivers
