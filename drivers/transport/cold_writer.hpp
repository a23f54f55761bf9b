// ColdWriter: a transport whose writes block. The kernel sends a HID output report while write()
// waits, O_NONBLOCK or not: usbhid_output_report() waits for its USB transfer up to 5 s
// (USB_CTRL_SET_TIMEOUT). In the reader thread that would hold up every stream, so send() only
// queues, and the thread that keeps the device writes.
#pragma once

#include <cstdint>

namespace posed::drivers {

class ColdWriter {
 public:
  virtual ~ColdWriter() = default;

  // Readable when something waits to be written.
  [[nodiscard]] virtual int waiting_fd() const noexcept = 0;

  // Writes what waits, oldest first; of a backlog only the newest few. One thread at a time, while
  // another reads and sends. Cold: may take seconds.
  virtual void write_waiting() noexcept = 0;

  // Messages that were given up so far, because newer ones waited or the queue was full. Any
  // thread.
  [[nodiscard]] virtual std::uint64_t dropped() const noexcept = 0;
};

}  // namespace posed::drivers
