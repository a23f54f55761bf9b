#include "daemon/publish/encode.hpp"

#include "proto/message/frame_message.hpp"

namespace posed::publish {

SampleEncoder::SampleEncoder(const std::string& stream, const drivers::SampleLayout& layout) {
  message_.set_stream(stream);
  for (const std::string& name : layout.names) message_.add_name(name);
  for (const std::string& unit : layout.units) message_.add_unit(unit);
}

const v1::Sample& SampleEncoder::encode(const Sample& sample) {
  message_.set_sequence(sample.header.sequence);
  if (sample.header.device_ns != kNoTime_ns) {
    message_.set_device_ns(sample.header.device_ns);
  } else {
    message_.clear_device_ns();
  }
  message_.set_arrival_ns(sample.header.arrival_ns);
  message::assign(*message_.mutable_value(), {sample.value.data(), sample.value_count});
  message::assign_flags(*message_.mutable_validity(), sample.valid, sample.value_count);
  message_.set_quality(static_cast<v1::Quality>(sample.quality));
  return message_;
}

}  // namespace posed::publish
