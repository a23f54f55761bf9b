// A minimal reader of MCAP, written from its specification: it goes through the file from begin to
// end and checks lengths, checksums, indexes and counts.
#pragma once

#include <cstdint>
#include <cstring>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <zlib.h>
#include <catch2/catch.hpp>

namespace posed::test {

struct McapMessage {
  std::string topic, schema;
  std::uint32_t sequence = 0;
  std::uint64_t log_ns = 0;
  std::string data;
};

class McapReader {
 public:
  explicit McapReader(std::string file) : file_(std::move(file)) {
    constexpr std::string_view kSigns("\x89MCAP0\r\n", 8);
    REQUIRE(file_.size() > 2 * kSigns.size());
    REQUIRE(std::string_view(file_).starts_with(kSigns));
    REQUIRE(std::string_view(file_).ends_with(kSigns));
    std::size_t at = kSigns.size();
    while (at < file_.size() - kSigns.size()) at = read_record(at);
    CHECK(at == file_.size() - kSigns.size());
    CHECK(ended_);
    CHECK(counted_ == messages.size());
  }

  std::vector<McapMessage> messages;           // in the order of the file
  std::map<std::string, std::string> schemas;  // name: descriptors
  std::size_t chunks = 0;

 private:
  class Fields {
   public:
    explicit Fields(std::string_view text) : text_(text) {}
    template <typename T>
    T number() {
      REQUIRE(text_.size() >= sizeof(T));
      T value{};
      std::memcpy(&value, text_.data(), sizeof(T));
      text_.remove_prefix(sizeof(T));
      return value;
    }
    std::string text() {
      const auto size = number<std::uint32_t>();
      REQUIRE(text_.size() >= size);
      std::string value(text_.substr(0, size));
      text_.remove_prefix(size);
      return value;
    }
    [[nodiscard]] std::string_view rest() const { return text_; }

   private:
    std::string_view text_;
  };

  static std::uint32_t crc(std::string_view bytes) {
    return static_cast<std::uint32_t>(
        crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
  }

  std::string_view content(std::string_view from, std::size_t at, std::uint8_t& opcode) const {
    Fields head(from.substr(at));
    opcode = head.number<std::uint8_t>();
    const auto size = head.number<std::uint64_t>();
    REQUIRE(head.rest().size() >= size);
    return head.rest().substr(0, size);
  }

  std::size_t read_record(std::size_t at) {
    std::uint8_t opcode = 0;
    const std::string_view body = content(file_, at, opcode);
    Fields fields(body);
    switch (opcode) {
      case 0x02:
        read_footer(fields, at);
        break;
      case 0x03:
        read_schema(fields);
        break;
      case 0x04:
        read_channel(fields);
        break;
      case 0x06:
        read_chunk(fields, at);
        break;
      case 0x07:
        read_message_index(fields);
        break;
      case 0x08:
        read_chunk_index(fields);
        break;
      case 0x0B:
        counted_ = fields.number<std::uint64_t>();
        break;
      case 0x0F:
        CHECK(fields.number<std::uint32_t>() == crc(std::string_view(file_).substr(0, at)));
        summary_ = at + 9 + body.size();
        break;
      default:
        CHECK((opcode == 0x01 || opcode == 0x0E));
        break;
    }
    return at + 9 + body.size();
  }

  void read_schema(Fields& fields) {
    const auto number = fields.number<std::uint16_t>();
    CHECK(number != 0);
    const std::string name = fields.text();
    CHECK(fields.text() == "protobuf");
    schemas[name] = fields.text();
    schema_names_[number] = name;
  }

  void read_channel(Fields& fields) {
    const auto number = fields.number<std::uint16_t>();
    const auto schema = fields.number<std::uint16_t>();
    REQUIRE(schema_names_.contains(schema));
    channels_[number] = {fields.text(), schema_names_[schema]};
    CHECK(fields.text() == "protobuf");
  }

  void read_chunk(Fields& fields, std::size_t at) {
    const auto first_ns = fields.number<std::uint64_t>();
    const auto last_ns = fields.number<std::uint64_t>();
    const auto size = fields.number<std::uint64_t>();
    const auto checksum = fields.number<std::uint32_t>();
    CHECK(fields.text().empty());
    CHECK(fields.number<std::uint64_t>() == size);
    chunk_ = fields.rest();
    REQUIRE(chunk_.size() == size);
    CHECK(crc(chunk_) == checksum);
    chunk_starts_.push_back(at);
    ++chunks;
    for (std::size_t place = 0; place < chunk_.size();) {
      std::uint8_t opcode = 0;
      const std::string_view body = content(chunk_, place, opcode);
      REQUIRE(opcode == 0x05);
      messages.push_back(message(body));
      CHECK(messages.back().log_ns >= first_ns);
      CHECK(messages.back().log_ns <= last_ns);
      place += 9 + body.size();
      ++unindexed_;
    }
  }

  McapMessage message(std::string_view body) {
    Fields fields(body);
    const auto channel = fields.number<std::uint16_t>();
    REQUIRE(channels_.contains(channel));
    McapMessage made{
        .topic = channels_[channel].first, .schema = channels_[channel].second, .data = {}};
    made.sequence = fields.number<std::uint32_t>();
    made.log_ns = fields.number<std::uint64_t>();
    CHECK(fields.number<std::uint64_t>() == made.log_ns);
    made.data = fields.rest();
    return made;
  }

  void read_message_index(Fields& fields) {
    const auto channel = fields.number<std::uint16_t>();
    Fields entries(fields.rest());
    const auto size = entries.number<std::uint32_t>();
    REQUIRE(entries.rest().size() == size);
    for (std::uint32_t i = 0; i < size / 16; ++i, --unindexed_) {
      const auto time_ns = entries.number<std::uint64_t>();
      std::uint8_t opcode = 0;
      const auto body = content(chunk_, entries.number<std::uint64_t>(), opcode);
      CHECK(opcode == 0x05);
      CHECK(message(body).topic == channels_[channel].first);
      CHECK(message(body).log_ns == time_ns);
    }
  }

  void read_chunk_index(Fields& fields) {
    CHECK(unindexed_ == 0);
    fields.number<std::uint64_t>();
    fields.number<std::uint64_t>();
    REQUIRE(indexed_chunks_ < chunk_starts_.size());
    CHECK(fields.number<std::uint64_t>() == chunk_starts_[indexed_chunks_++]);
  }

  void read_footer(Fields& fields, std::size_t at) {
    CHECK(indexed_chunks_ == chunks);
    CHECK(fields.number<std::uint64_t>() == summary_);
    fields.number<std::uint64_t>();
    const std::size_t covered = at + 9 + 16;  // up to the checksum
    CHECK(fields.number<std::uint32_t>() ==
          crc(std::string_view(file_).substr(summary_, covered - summary_)));
    ended_ = true;
  }

  std::string file_;
  std::string_view chunk_;
  std::map<std::uint16_t, std::string> schema_names_;
  std::map<std::uint16_t, std::pair<std::string, std::string>> channels_;  // topic, schema
  std::vector<std::size_t> chunk_starts_;
  std::size_t indexed_chunks_ = 0, unindexed_ = 0, summary_ = 0;
  std::uint64_t counted_ = 0;
  bool ended_ = false;
};

}  // namespace posed::test
