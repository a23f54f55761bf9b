#include "drivers/transport/ports.hpp"

#include <unistd.h>

namespace posed::drivers {

Ports::~Ports() {
  for (const auto& [endpoint, listener] : listeners_) ::close(listener);
}

}  // namespace posed::drivers
