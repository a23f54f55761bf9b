// ColdWriter: a transport whose writes block. For a HID output report the kernel blocks in write(),
// with or without O_NONBLOCK: usbhid_output_report() waits for its USB transfer up to 5 s
// (USB_CTRL_SET_TIMEOUT). In the reader thread that would delay every stream, so send() only
// queues, and the device's supervisor thread writes.
#pragma once

#include <cstdint>

namespace posed::drivers {

class ColdWriter {
 public:
  virtual ~ColdWriter() = default;

  // Readable when a message is waiting to be written.
  [[nodiscard]] virtual int waiting_fd() const noexcept = 0;

  // Writes the waiting messages, oldest first; of a backlog only the newest few. Only one thread
  // may call it at a time, while another reads and sends. Cold: may take seconds.
  virtual void write_waiting() noexcept = 0;

  // Number of messages dropped so far, because newer ones were waiting or the queue was full. Any
  // thread.
  [[nodiscard]] virtual std::uint64_t dropped() const noexcept = 0;
};

}  // namespace posed::drivers
