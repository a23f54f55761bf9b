// What Rokoko Studio's decoder does with JSON and LZ4 frames that are damaged or hostile.
#include <catch2/catch.hpp>

#include <lz4frame.h>

#include <random>

#include <nlohmann/json.hpp>

#include "drivers/driver.hpp"
#include "drivers/json_reader.hpp"
#include "drivers/rokoko/decoder.hpp"
#include "drivers/rokoko/emulator.hpp"
#include "tests/support/allocations.hpp"
#include "tests/support/file_text.hpp"
#include "tests/unit/drivers/collect_sink.hpp"
#include "tests/unit/drivers/refused.hpp"

namespace posed::drivers::rokoko {
namespace {

using test::bytes_of;
using test::CollectSink;
using Bytes = std::vector<std::byte>;
using Fault = JsonReader::Fault;

// How reading the whole text as one value ends.
Fault fault_of(std::string_view text) {
  JsonReader json(text);
  json.skip();
  if (json.ok() && !json.at_end()) return Fault::kWrong;
  return json.fault();
}

Outcome outcome_of(std::span<const std::byte> bytes) {
  static const auto decoder = std::make_unique<StudioDecoder>();
  CollectSink sink(0);
  decoder->feed(bytes, 0, sink);
  for (int i = 0; i < kOutcomes; ++i) {
    if (sink.outcomes[static_cast<std::size_t>(i)] == 1) return static_cast<Outcome>(i);
  }
  FAIL("a datagram has one outcome");
  return Outcome::kOk;
}

std::string plain_frame() {
  StudioEmulator emulator({.rate_hz = 60.0, .version = StudioVersion::k3, .lz4 = false});
  Bytes bytes;
  emulator.emit(0, bytes);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

Bytes packed(std::string_view text, const LZ4F_preferences_t& preferences) {
  Bytes bytes(LZ4F_compressFrameBound(text.size(), &preferences));
  const std::size_t size =
      LZ4F_compressFrame(bytes.data(), bytes.size(), text.data(), text.size(), &preferences);
  REQUIRE(LZ4F_isError(size) == 0);
  bytes.resize(size);
  return bytes;
}

struct Unpacked {
  Outcome outcome;
  std::string text;
};

Unpacked unpacked(std::span<const std::byte> bytes, std::size_t room = 256 * 1024) {
  Bytes memory(room);
  std::span<const std::byte> content;
  const Outcome outcome = decode_lz4_frame(bytes, memory, content);
  if (outcome != Outcome::kOk) return {outcome, {}};
  return {outcome, {reinterpret_cast<const char*>(content.data()), content.size()}};
}

}  // namespace

TEST_CASE("the JSON reader takes what JSON is, and says what is wrong with the rest") {
  for (const char* good :
       {"{}", "[]", " { \"a\" : [ 1 , -2.5e-3, true, false, null, \"x\\\"y\" ] } ",
        "[[[{}]],{\"\":{}}]", "NaN", "-Infinity", "\"\"", "0"}) {
    INFO(good);
    CHECK(fault_of(good) == Fault::kNone);
  }
  for (const char* cut : {"", " ", "{", "[1,", "{\"a\"", "{\"a\":", "\"x", "\"x\\", "tru", "nul",
                          "-", "{\"a\":1", "[1"}) {
    INFO(cut);
    CHECK(fault_of(cut) == Fault::kCut);
  }
  for (const char* wrong :
       {"}",     "]",      "{]",         "[}",    "{1:2}", "{\"a\" 1}", "{\"a\":}",
        "[1 2]", "[,]",    "{\"a\":1,}", "truth", "nil",   "+1",        "--1",
        "-x",    "\"\n\"", "{} {}",      "[1,]",  "0x10",  "'a'",       "{\"a\":1 \"b\":2}"}) {
    INFO(wrong);
    CHECK(fault_of(wrong) == Fault::kWrong);
  }
  CHECK(fault_of(std::string(32, '[') + std::string(32, ']')) == Fault::kNone);
  CHECK(fault_of(std::string(33, '[')) == Fault::kDeep);
  CHECK(fault_of(std::string(100'000, '[')) == Fault::kDeep);
  std::string objects;
  for (int i = 0; i < 40; ++i) objects += "{\"a\":";
  CHECK(fault_of(objects) == Fault::kDeep);
}

TEST_CASE("the JSON reader agrees with nlohmann's on numbers, strings and structure") {
  const std::string text = plain_frame();
  const auto peer = nlohmann::json::parse(text);
  std::vector<double> ours, theirs;
  const std::function<void(const nlohmann::json&)> walk = [&](const nlohmann::json& value) {
    if (value.is_number()) theirs.push_back(value.get<double>());
    if (value.is_structured()) {
      for (const auto& child : value) walk(child);
    }
  };
  for (const auto& actor : peer["scene"]["actors"]) walk(actor["body"]);
  JsonReader json(text);
  const std::function<void()> read = [&] {
    std::string_view key;
    if (JsonReader probe = json; probe.enter_object()) {
      REQUIRE(json.enter_object());
      while (json.next(key)) read();
    } else if (double number = 0.0; json.number(number)) {
      ours.push_back(number);
    }
  };
  std::string_view key;
  REQUIRE(json.enter_object());
  while (json.next(key)) {
    if (key != "scene") {
      json.skip();
      continue;
    }
    REQUIRE(json.enter_object());
    while (json.next(key)) {
      if (key != "actors") {
        json.skip();
        continue;
      }
      REQUIRE(json.enter_array());
      while (json.next()) {
        REQUIRE(json.enter_object());
        while (json.next(key)) key == "body" ? read() : json.skip();
      }
    }
  }
  CHECK(json.ok());
  std::ranges::sort(ours);  // nlohmann sorts its keys
  std::ranges::sort(theirs);
  CHECK(ours.size() == (63 + 23) * 7);
  CHECK(ours == theirs);
}

TEST_CASE("JSON strings become UTF-8, cut between two characters") {
  const auto text_of = [](std::string_view raw, std::size_t room) {
    std::string text(room, '?');
    text.resize(unescape_json(raw, text));
    return text;
  };
  CHECK(text_of("a\\n\\\"\\u00e9\\ud83d\\ude00", 64) == "a\n\"\xc3\xa9\xf0\x9f\x98\x80");
  CHECK(text_of("\\ud83d x \\uZZZZ \\q", 64) == "\\ud83d x \\uZZZZ \\q");
  CHECK(text_of("ab\xc3\xa9", 3) == "ab");
  CHECK(text_of("ab\\u00e9", 3) == "ab");
  CHECK(text_of("abc\xc3\xa9", 3) == "abc");
  CHECK(text_of("", 3).empty());
}

TEST_CASE("a frame of Studio cut anywhere is short and emits nothing") {
  const std::string whole = plain_frame();
  for (std::size_t size = 1; size < whole.size(); size += 1 + size / 60) {
    CHECK(outcome_of(bytes_of(std::string_view(whole).substr(0, size))) == Outcome::kShort);
  }
  CHECK(outcome_of(bytes_of(whole + "x")) == Outcome::kShort);
}

TEST_CASE("datagrams that are not Studio's, too deep or too many") {
  CHECK(outcome_of({}) == Outcome::kForeign);
  for (const char* foreign : {"hello", "[]", "3", "{\"a\":1}", "{\"version\":1}",
                              "{\"version\":\"x\"}", "{\"version\":null}"}) {
    CHECK(outcome_of(bytes_of(foreign)) == Outcome::kForeign);
  }
  CHECK(outcome_of(bytes_of("{\"version\":3," + std::string(2000, '['))) == Outcome::kShort);
  CHECK(outcome_of(bytes_of("{\"a\":" + std::string(2000, '['))) == Outcome::kOutOfRange);
  std::string many = "{\"version\":3,\"scene\":{\"actors\":[{}";
  for (int i = 0; i < 32; ++i) many += ",{}";
  CHECK(outcome_of(bytes_of(many + "]}}")) == Outcome::kOutOfRange);
  CHECK(outcome_of(
            bytes_of("{\"version\":3,\"scene\":{\"actors\":[1,null,[],\"x\"],\"props\":7}}")) ==
        Outcome::kForeign);  // nobody there, and no layout yet
  CHECK(outcome_of(bytes_of("{\"version\":" + std::string(60'000, '9') + "}")) ==
        Outcome::kForeign);
}

TEST_CASE("one writer's LZ4 frames hold their texts, of any size, one after another") {
  Lz4Writer writer;
  std::vector<std::byte> memory(300'000);
  for (const std::size_t size : {9'000U, 1U, 200'000U, 65'536U, 65'537U, 500U}) {
    std::string text(size, '0');
    for (std::size_t i = 0; i < size; ++i) text[i] = static_cast<char>('0' + i * i % 13);
    std::span<const std::byte> content;
    REQUIRE(decode_lz4_frame(writer.compress(text), memory, content) == Outcome::kOk);
    CHECK(std::ranges::equal(content, std::as_bytes(std::span(text))));
  }
}

TEST_CASE("LZ4 frames of liblz4 in all forms are unpacked") {
  std::mt19937 random(5);
  std::string text;
  while (text.size() < 200'000) text += "joint " + std::to_string(random() % 1000) + ' ';
  for (const std::size_t size : {0U, 1U, 100U, 70'000U, 200'000U}) {
    const std::string_view part = std::string_view(text).substr(0, size);
    for (unsigned bits = 0; bits < 16; ++bits) {
      LZ4F_preferences_t preferences{};
      preferences.frameInfo.blockSizeID = (bits & 8U) != 0 ? LZ4F_max256KB : LZ4F_max64KB;
      preferences.frameInfo.blockMode = (bits & 1U) != 0 ? LZ4F_blockLinked : LZ4F_blockIndependent;
      preferences.frameInfo.contentChecksumFlag =
          (bits & 2U) != 0 ? LZ4F_contentChecksumEnabled : LZ4F_noContentChecksum;
      preferences.frameInfo.blockChecksumFlag =
          (bits & 4U) != 0 ? LZ4F_blockChecksumEnabled : LZ4F_noBlockChecksum;
      preferences.frameInfo.contentSize = (bits & 1U) != 0 ? size : 0;
      const Bytes frame = packed(part, preferences);
      const auto [outcome, got] = unpacked(frame);
      CHECK(outcome == Outcome::kOk);
      CHECK(got == part);
    }
  }
  std::string noise(5000, '\0');  // is stored, not compressed
  for (char& c : noise) c = static_cast<char>(random());
  CHECK(unpacked(packed(noise, {})).text == noise);
}

TEST_CASE("LZ4 bombs and damaged frames are refused") {
  LZ4F_preferences_t sums{};
  sums.frameInfo.contentChecksumFlag = LZ4F_contentChecksumEnabled;
  const std::string hello = "hello hello hello hello hello hello";
  const Bytes good = packed(hello, sums);
  REQUIRE(unpacked(good).outcome == Outcome::kOk);
  for (std::size_t size = 0; size < good.size(); ++size) {
    CHECK(unpacked(std::span(good).first(size)).outcome != Outcome::kOk);
  }
  std::mt19937 random(3);
  for (int round = 0; round < 5000; ++round) {
    Bytes bad = good;
    bad[random() % bad.size()] ^= static_cast<std::byte>(1 + random() % 255);
    const auto [outcome, text] = unpacked(bad, 64);
    if (outcome == Outcome::kOk) CHECK(text == hello);  // words that repeat can be packed otherwise
  }
  Bytes longer = good;
  longer.push_back({});
  CHECK(unpacked(longer).outcome == Outcome::kShort);
  for (const bool says_size : {false, true}) {
    LZ4F_preferences_t preferences{};
    preferences.frameInfo.contentSize = says_size ? 8'000'000 : 0;
    const Bytes bomb = packed(std::string(8'000'000, ' '), preferences);
    CHECK(bomb.size() < kMaxChunk);
    CHECK(outcome_of(bomb) == Outcome::kOutOfRange);
  }
}

TEST_CASE("any bytes for Studio's decoder: one outcome each, sound frames, no allocation") {
  std::mt19937 random(31);
  const std::string whole = plain_frame();
  const Bytes lz4 = packed(whole, {});
  const auto decoder = std::make_unique<StudioDecoder>();
  CollectSink sink(10'000);
  decoder->feed(bytes_of(whole), 0, sink);
  const auto layout = find_driver("rokoko")->make_layout(sink.described).value();
  decoder->use(*layout);
  std::vector<Bytes> bad;
  for (int round = 0; round < 600; ++round) {
    const auto from = round % 2 == 0 ? bytes_of(whole) : std::span<const std::byte>(lz4);
    Bytes bytes(from.begin(), from.end());
    for (int flips = 0; flips <= round % 6; ++flips) {
      bytes[random() % bytes.size()] =
          static_cast<std::byte>(random() % (round % 3 == 0 ? 256 : 128));
    }
    bad.push_back(std::move(bytes));
  }
  const std::uint64_t before = test::allocations();
  for (const Bytes& bytes : bad) decoder->feed(bytes, 0, sink);
  CHECK(test::allocations() == before);
  int outcomes = 0;
  for (const int count : sink.outcomes) outcomes += count;
  CHECK(outcomes == 601);
  bool valid = true;
  for (const Frame& frame : sink.frames) valid = valid && test::is_valid(frame);
  for (const Sample& sample : sink.samples) valid = valid && test::is_valid(sample);
  CHECK(valid);
}

TEST_CASE("any description of Studio's bodies is refused or becomes bodies") {
  std::mt19937 random(41);
  CollectSink sink;
  StudioDecoder().feed(bytes_of(plain_frame()), 0, sink);
  const Bytes good = sink.described;
  REQUIRE(find_driver("rokoko")->make_layout(good));
  for (std::size_t size = 0; size < good.size(); ++size) {
    CHECK_FALSE(find_driver("rokoko")->make_layout(std::span(good).first(size)));
  }
  Bytes longer = good;
  longer.push_back({});
  CHECK_FALSE(find_driver("rokoko")->make_layout(longer));
  for (int round = 0; round < 3000; ++round) {
    Bytes bad = good;
    for (int flips = 0; flips <= round % 4; ++flips) {
      bad[random() % (round % 2 == 0 ? 30 : bad.size())] = static_cast<std::byte>(random());
    }
    const auto layout = find_driver("rokoko")->make_layout(bad);
    if (!layout) CHECK_FALSE(layout.error().message.empty());
  }
}

TEST_CASE("wrong options of Rokoko Studio are refused at once") {
  const Driver& driver = *find_driver("rokoko");
  test::check_refused(driver, {{{{"listen", std::string("0.0.0.0:14043")}}, "peers"},
                               {{{"version", std::string("1")}}, "2, 2.5 or 3"},
                               {{{"rate_hz", 0.0}}, "rate_hz"}});
  test::check_undescribed(driver,
                          {"", "rokoko", "rokoko rate=", "rokoko rate=nan", "rokoko rate=0"});
}

}  // namespace posed::drivers::rokoko
