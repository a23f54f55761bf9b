#include "drivers/transport/transport_factory.hpp"

#include <unistd.h>

namespace posed::drivers {

TransportFactory::~TransportFactory() {
  for (const auto& [endpoint, listener] : listeners_) ::close(listener);
}

}  // namespace posed::drivers
