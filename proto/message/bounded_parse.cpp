#include "proto/message/bounded_parse.hpp"

#include <cstdint>

#include <google/protobuf/descriptor.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/message.h>
#include <google/protobuf/wire_format_lite.h>

namespace posed::message {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::internal::WireFormatLite;
using google::protobuf::io::CodedInputStream;

constexpr int kMaxDepth = 16;  // messages within messages; the schema has a few

// Takes the parts of one message from `left`; false when there are more, or if the bytes are
// malformed. Groups, which the schema does not use, count as malformed.
bool take_parts(const Descriptor& type, CodedInputStream& in, std::size_t& left, int depth) {
  if (depth > kMaxDepth) return false;
  while (const std::uint32_t tag = in.ReadTag()) {
    const FieldDescriptor* const field =
        type.FindFieldByNumber(WireFormatLite::GetTagFieldNumber(tag));
    const bool text = field != nullptr && field->cpp_type() == FieldDescriptor::CPPTYPE_STRING;
    const bool part =
        field == nullptr || text || field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE;
    if (part && left-- == 0) return false;
    switch (WireFormatLite::GetTagWireType(tag)) {
      case WireFormatLite::WIRETYPE_LENGTH_DELIMITED: {
        std::uint32_t size = 0;
        if (!in.ReadVarint32(&size)) return false;
        if (field == nullptr || field->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) {
          if (!in.Skip(static_cast<int>(size))) return false;
          break;
        }
        const auto outer = in.PushLimit(static_cast<int>(size));
        const bool counted = take_parts(*field->message_type(), in, left, depth + 1);
        if (!counted || in.BytesUntilLimit() > 0) return false;
        in.PopLimit(outer);
        break;
      }
      case WireFormatLite::WIRETYPE_START_GROUP:
      case WireFormatLite::WIRETYPE_END_GROUP:
        return false;
      default:
        if (!WireFormatLite::SkipField(&in, tag)) return false;
    }
  }
  return true;
}

}  // namespace

std::optional<std::size_t> count_parts(const google::protobuf::Message& type,
                                       std::span<const std::byte> bytes) {
  const auto size = static_cast<int>(bytes.size());
  CodedInputStream in(reinterpret_cast<const std::uint8_t*>(bytes.data()), size);
  std::size_t left = kMaxMessageParts;
  const bool taken = take_parts(*type.GetDescriptor(), in, left, 0);
  if (!taken || in.CurrentPosition() != size) return std::nullopt;
  return kMaxMessageParts - left;
}

bool parse_bounded(google::protobuf::Message& message, std::span<const std::byte> bytes) {
  if (!count_parts(message, bytes)) {
    message.Clear();
    return false;
  }
  return message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()));
}

}  // namespace posed::message
