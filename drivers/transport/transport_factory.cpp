#include "drivers/transport/transport_factory.hpp"

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
  return SubscriptionTransport::open(settings, *cancel_);
}

}  // namespace posed::drivers
