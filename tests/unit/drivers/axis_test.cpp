// The Axis streams: their messages byte by byte, the finding of messages in cut and damaged bytes,
// and everything that is refused.
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <random>

#include "drivers/axis/description.hpp"
#include "tests/support/allocations.hpp"
#include "tests/unit/drivers/axis_rig.hpp"
#include "tests/unit/drivers/refused.hpp"

namespace posed::drivers {
namespace {

using axis::Content;
using axis::Form;
using axis::Message;
using test::axis_bytes;
using test::axis_message;
using test::axis_text_bytes;
using test::AxisBytes;
using test::AxisRig;

constexpr std::array kForms{Form::kBinary, Form::kOldBinary, Form::kText};
constexpr std::array<Content, 4> kAllContents{
    {{false, false}, {false, true}, {true, false}, {true, true}}};

void put(AxisBytes& bytes, std::size_t at, std::initializer_list<unsigned> values) {
  for (const unsigned value : values) bytes[at++] = static_cast<std::byte>(value);
}

// "0 Ann 1.000000 ... ||" without some of its values.
std::string text_of(std::string_view head, std::size_t values, std::string_view end = "||") {
  std::string text(head);
  for (std::size_t i = 0; i < values; ++i) text += " " + std::to_string(i % 7);
  return text + std::string(end);
}

}  // namespace

TEST_CASE("the numbers of an Axis text are those of std::to_chars") {
  std::mt19937 random(7);
  Message message = axis_message(1, "Ann", 1, {true, true});
  const std::size_t count = axis::value_count(message.content);
  constexpr std::array kCorners{0.0,      -0.0,      0.0000005, 0.5000005,  2.5e-7,
                                -4e-7,    0.9999995, 99.999,    99.9999996, -100.0,
                                999999.5, 1e6,       -1e9,      123456789.5};
  for (int round = 0; round < 200; ++round) {
    for (std::size_t i = 0; i < count; ++i) {
      const double size = std::pow(10.0, static_cast<double>(random() % 10) - 4.0);
      const double value = size * (static_cast<double>(random()) / 2147483648.0 - 1.0);
      // Half of them, as most that are sent, were floats, or lie on halves of the last decimal.
      message.values[i] = i % 4 == 0   ? static_cast<double>(static_cast<float>(value))
                          : i % 4 == 1 ? std::round(value * 1e6) / 1e6 + 5e-7
                                       : value;
    }
    std::ranges::copy(kCorners, message.values.begin());
    std::vector<char> text(axis::kMaxText);
    text.resize(axis::encode_text(message, text));
    std::string expected = "1 Ann";
    for (std::size_t i = 0; i < count; ++i) {
      std::array<char, 64> number{};
      (void)std::snprintf(number.data(), number.size(), " %.6f", message.values[i]);
      expected += number.data();
    }
    REQUIRE(std::string_view(text.data(), text.size()) == expected + " ||");
  }
}

TEST_CASE("an Axis header has the bytes of its drawing") {
  Message message = axis_message(0x0102, "Ann", 0x0A0B0C0D, {false, true});
  message.values[0] = -2.0;
  const AxisBytes bytes = axis_bytes(message);
  REQUIRE(bytes.size() == 64 + 4 * 186);
  AxisBytes expected(68);
  put(expected, 0, {0xFF, 0xDD, 0, 0, 1, 1, 186, 0, 0, 1, 2, 1, 0, 0, 'A', 'n', 'n'});
  put(expected, 46, {0x0D, 0x0C, 0x0B, 0x0A});
  put(expected, 62, {0xFF, 0xEE, 0, 0, 0, 0xC0});
  CHECK(std::ranges::equal(std::span(bytes).first(68), expected));
}

TEST_CASE("an Axis header of version 1.0 has the bytes of its drawing") {
  const AxisBytes bytes = axis_bytes(axis_message(3, "Bo", 9), Form::kOldBinary);
  REQUIRE(bytes.size() == 64 + 4 * 354);
  AxisBytes expected(64);
  put(expected, 0, {0xFF, 0xDD, 0, 0, 0, 1, 354 - 256, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 3});
  put(expected, 22, {'B', 'o'});
  put(expected, 62, {0xFF, 0xEE});
  CHECK(std::ranges::equal(std::span(bytes).first(64), expected));
}

TEST_CASE("an Axis text message is one line of words that ends in two bars") {
  Message message = axis_message(1, "Ann B|", 5, {});
  message.values[0] = -8.964398;
  message.values[1] = 1e-9;
  const AxisBytes bytes = axis_bytes(message, Form::kText);
  const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  CHECK(
      text.starts_with("1 Ann_B_ -8.964398 0.000000 0.000000 0.000000 0.250000 0.500000 0.250000"));
  CHECK(text.ends_with(" 15.000000 ||"));
}

TEST_CASE("every Axis message is decoded as it was encoded, without allocating") {
  AxisBytes room(axis::kMaxText);
  const std::span chars(reinterpret_cast<char*>(room.data()), room.size());
  for (const Content content : kAllContents) {
    const Message sent = axis_message(7, "Ann", 42, content);
    for (const Form form : kForms) {
      const std::uint64_t before = test::allocations();
      Message got;
      Outcome outcome = Outcome::kForeign;
      if (form == Form::kText) {
        const std::size_t size = axis::encode_text(sent, chars);
        outcome = axis::decode_text({chars.data(), size - 2}, got);
      } else {
        const std::size_t size = axis::encode_binary(sent, form, room);
        outcome = axis::decode_binary(std::span(room).first(size), got);
      }
      CHECK(test::allocations() == before);
      CHECK(outcome == Outcome::kOk);
      CHECK(got.avatar == sent.avatar);
      CHECK(got.content == content);
      CHECK(got.frame_number == (form == Form::kBinary ? 42 : 0));
      for (std::size_t i = 0; i < axis::value_count(content); ++i) {
        CHECK(std::abs(got.values[i] - sent.values[i]) < 2e-6);
      }
    }
  }
}

TEST_CASE("reading numbers of an Axis text does not allocate, however they are written") {
  for (const char* word : {"0.1234567890123456789012345678901234567890", "-1.5e-300", "1e-5000",
                           "12345678901234567890123456789e-25", "nan", "1e400", "x"}) {
    const std::string text = text_of("0 Ann", 100, " ") + word + text_of("", 253, "");
    Message message;
    const std::uint64_t before = test::allocations();
    const Outcome outcome = axis::decode_text(text, message);
    CHECK(test::allocations() == before);
    const std::string_view refused(word);
    const bool number = refused != "nan" && refused != "1e400" && refused != "x";
    CHECK(outcome == (number ? Outcome::kOk : Outcome::kOutOfRange));
  }
}

TEST_CASE("the numbers of an Axis text are those that printf writes") {
  std::mt19937_64 random(1);
  Message message = axis_message(1, "Ann", 5, {true, true});
  AxisBytes room(axis::kMaxText);
  const std::span chars(reinterpret_cast<char*>(room.data()), room.size());
  const std::size_t count = axis::value_count(message.content);
  std::vector<axis::ShortText> known(count / 3);
  for (int round = 0; round < 500; ++round) {
    std::string expected = "1 Ann";
    for (std::size_t i = 0; i < count; ++i) {
      const double sign = random() % 2 == 0 ? 1.0 : -1.0;
      const double scale = std::pow(10.0, static_cast<double>(random() % 10) - 6.0);
      double value = scale * static_cast<double>(random()) / static_cast<double>(~0ULL);
      // Halves of the last place, exact ones and the two beside them.
      if (i % 4 == 1) value = std::round(value * 64.0) / 128.0 + 0.0000005;
      if (i % 4 == 2) value = static_cast<double>(random() % 100'000) / 128.0;
      if (i % 4 == 3) {
        const double half = (std::floor(value * 1e6) + 0.5) * 1e-6;
        value = round % 3 == 0 ? half : std::nextafter(half, round % 3 == 1 ? 0.0 : 1e9);
      }
      message.values[i] = sign * value;
      std::array<char, 64> text{};
      std::snprintf(text.data(), text.size(), " %.6f", message.values[i]);
      expected += text.data();
    }
    const std::size_t size = axis::encode_text(message, chars);
    REQUIRE(std::string_view(chars.data(), size) == expected + " ||");
    // The same with the text of the values before, of which one group has changed.
    const auto with_known = [&] {
      return std::string(chars.data(), axis::encode_text(message, chars, known));
    };
    for (axis::ShortText& text : known) text.size = 0;
    CHECK(with_known() == expected + " ||");
    const std::size_t changed = random() % known.size();
    message.values[3 * changed] = 0.25 * round;
    known[changed].size = 0;
    const std::string plain(chars.data(), axis::encode_text(message, chars));
    CHECK(with_known() == plain);
    CHECK(with_known() == plain);
  }
}

TEST_CASE("an Axis message that does not fit its buffer is not encoded") {
  Message message = axis_message(9999, std::string(32, 'n'), 1, {true, true});
  message.values.fill(-123456.789);
  AxisBytes room(axis::kMaxText);
  const std::span chars(reinterpret_cast<char*>(room.data()), room.size());
  const std::size_t binary = axis::encode_binary(message, Form::kBinary, room);
  CHECK(binary == axis::kMaxBinary);
  CHECK(axis::encode_binary(message, Form::kBinary, std::span(room).first(binary - 1)) == 0);
  const std::size_t text = axis::encode_text(message, chars);
  CHECK(text > 0);
  for (std::size_t size = 0; size < text; ++size) {
    CHECK(axis::encode_text(message, chars.first(size)) == 0);
  }
  CHECK(axis::encode_text(message, chars.first(text)) == text);
}

TEST_CASE("Axis headers that cannot be are counted") {
  AxisRig rig;
  const Message message = axis_message(0, "Ann", 1);
  rig.introduce(message);
  const AxisBytes good = axis_bytes(message);
  const AxisBytes old = axis_bytes(message, Form::kOldBinary);
  const auto changed = [](AxisBytes bytes, std::size_t at, std::initializer_list<unsigned> values) {
    put(bytes, at, values);
    return bytes;
  };
  // Damage is counted once until a sound message.
  const auto outcome = [&](const AxisBytes& bytes) {
    CHECK(rig.outcome_of(good) == Outcome::kOk);
    return rig.outcome_of(bytes);
  };
  CHECK(outcome(changed(good, 6, {0, 0})) == Outcome::kOutOfRange);            // count
  CHECK(outcome(changed(good, 6, {0xFF, 0xFF})) == Outcome::kOutOfRange);      // -1 or huge
  CHECK(outcome(changed(good, 6, {0x68, 0x01})) == Outcome::kOutOfRange);      // 360
  CHECK(outcome(changed(good, 8, {0})) == Outcome::kOutOfRange);               // displacement
  CHECK(outcome(changed(good, 9, {2})) == Outcome::kOutOfRange);               // no flag
  CHECK(outcome(changed(good, 10, {0, 0, 0, 0x80})) == Outcome::kOutOfRange);  // avatar
  CHECK(outcome(changed(good, 5, {0})) == Outcome::kOutOfRange);               // version
  CHECK(outcome(changed(good, 62, {0, 0})) == Outcome::kForeign);              // no end
  CHECK(outcome(changed(good, 0, {0xFF, 0x88})) == Outcome::kForeign);
  CHECK(outcome(changed(old, 6, {0xFF, 0xFF, 0xFF, 0xFF})) == Outcome::kOutOfRange);
  CHECK(outcome(changed(old, 10, {0, 1})) == Outcome::kOutOfRange);
  CHECK(outcome(old) == Outcome::kOk);
}

TEST_CASE("Axis values that no pose has are counted, and the other avatars are kept") {
  AxisRig rig;
  rig.now_ns = kNanosPerSecond;
  rig.introduce(axis_message(0, "Ann", 1));
  for (const Form form : kForms) {
    Message message = axis_message(0, "Ann", 0);
    for (const std::size_t at : {0U, 5U, 200U, 353U}) {
      const double before = message.values[at];
      message.values[at] = 2e5;
      CHECK(rig.outcome_of(axis_bytes(message, form)) == Outcome::kOutOfRange);
      message.values[at] = std::numeric_limits<double>::quiet_NaN();
      CHECK(rig.outcome_of(axis_bytes(message, form)) == Outcome::kOutOfRange);
      message.values[at] = -std::numeric_limits<double>::infinity();
      CHECK(rig.outcome_of(axis_bytes(message, form)) == Outcome::kOutOfRange);
      message.values[at] = before;
    }
    CHECK(rig.outcome_of(axis_bytes(message, form)) == Outcome::kOk);
  }
}

TEST_CASE("Axis calculation data is foreign, and the motion between it is decoded") {
  AxisRig rig;
  rig.introduce(axis_message(0, "Ann", 1));
  AxisBytes bytes;
  std::mt19937 random(3);
  for (int i = 0; i < 5; ++i) {
    AxisBytes calculation(64 + 4 * 338);
    put(calculation, 0, {0xFF, 0x88, 0, 0, 1, 1, 0x52, 1});
    put(calculation, 62, {0xFF, 0x99});
    for (std::size_t at = 64; at < calculation.size(); ++at) {
      calculation[at] = static_cast<std::byte>(random() % 255);  // no start of a header
    }
    bytes.insert(bytes.end(), calculation.begin(), calculation.end());
    const AxisBytes motion = axis_bytes(axis_message(0, "Ann", 2));
    bytes.insert(bytes.end(), motion.begin(), motion.end());
  }
  rig.feed(bytes);
  CHECK(rig.sink.count(Outcome::kOk) == 5);
  CHECK(rig.sink.count(Outcome::kForeign) == 5);
  CHECK(rig.sink.frames.size() == 5);
}

TEST_CASE("damaged Axis texts are counted") {
  AxisRig rig;
  rig.introduce(axis_message(0, "Ann", 1));
  const auto outcome = [&](const std::string& text) {
    return rig.outcome_of(axis_text_bytes(text));
  };
  CHECK(outcome(text_of("0 Ann", 354)) == Outcome::kOk);
  CHECK(outcome(text_of("\r\n 0  Ann\t", 180, "\r\n||")) == Outcome::kOk);
  CHECK(outcome(text_of("0 Ann", 353)) == Outcome::kShort);
  CHECK(outcome(text_of("0 Ann", 400)) == Outcome::kShort);
  CHECK(outcome(text_of("0 Ann", 355)) == Outcome::kForeign);  // unknown: it may be named "Ann 0"
  CHECK(outcome(text_of("0", 355)) == Outcome::kForeign);      // or "0"
  CHECK(outcome(text_of("0", 356)) == Outcome::kShort);        // but not "0 1"
  CHECK(outcome("||") == Outcome::kShort);
  CHECK(outcome("0||") == Outcome::kShort);
  CHECK(outcome(text_of("-1 Ann", 354)) == Outcome::kOutOfRange);
  CHECK(outcome(text_of("4294967296 Ann", 354)) == Outcome::kOutOfRange);
  CHECK(outcome(text_of("10000 Ann", 354)) == Outcome::kOutOfRange);
  CHECK(outcome(text_of("0.5 Ann", 354)) == Outcome::kOutOfRange);
  for (const char* word : {"nan", "inf", "-", "1.2.3", "0x10", "1,5", "1e999", "--1"}) {
    CHECK(outcome(text_of("0 Ann", 300, "") + " " + word + text_of("", 53)) ==
          Outcome::kOutOfRange);
  }
  CHECK(outcome(text_of("0 Ann", 300, "") + " +1e-3 -.5" + text_of("", 52)) == Outcome::kOk);
  CHECK(outcome(text_of("0 Ann", 300, "") + "\x01" + text_of("", 54)) == Outcome::kShort);
  CHECK(outcome(text_of("0 Ann", 354)) == Outcome::kOk);
}

TEST_CASE("an Axis name may have blanks, bars and any letters") {
  const auto name_in = [](const std::string& name, std::size_t values) {
    AxisRig rig;
    rig.feed(axis_text_bytes(text_of("3 " + name, values)));
    REQUIRE(rig.layouts.size() == 1);
    return rig.layouts[0]->bodies[0].name;
  };
  CHECK(name_in("Ann", 180) == "Ann");
  CHECK(name_in("Ann Lee", 354) == "Ann Lee");
  CHECK(name_in("Player 2", 360) == "Player 2");
  CHECK(name_in("a b c d e 6", 354) == "a b c d e 6");
  CHECK(name_in("7", 186) == "7");
  CHECK(name_in("a|b", 354) == "a|b");
  CHECK(name_in("\xE5\xA7\x93", 354) == "\xE5\xA7\x93");
  CHECK(name_in("\xD0\xD5", 354) == "\\xd0\\xd5");  // not UTF-8
}

TEST_CASE("Axis messages are found whatever is before, between and cut from them") {
  AxisRig rig;
  rig.introduce(axis_message(0, "Ann", 1));
  const AxisBytes binary = axis_bytes(axis_message(0, "Ann", 2));
  const AxisBytes text = axis_bytes(axis_message(0, "Ann", 2), Form::kText);
  const std::vector<AxisBytes> garbage{{},
                                       AxisBytes(7, std::byte{0xEE}),
                                       AxisBytes(3, std::byte{0xFF}),
                                       AxisBytes(70),
                                       axis_text_bytes("0 Ann 1 2 3"),
                                       {binary.begin(), binary.begin() + 900},
                                       {binary.begin() + 64, binary.end()},
                                       {text.begin(), text.begin() + 900}};
  for (const AxisBytes& before : garbage) {
    AxisBytes bytes = before;
    for (int i = 0; i < 3; ++i) bytes.insert(bytes.end(), binary.begin(), binary.end());
    rig.sink.clear();
    rig.feed(bytes);
    CHECK(rig.sink.frames.size() == 3);
    CHECK(rig.sink.count(Outcome::kOk) == 3);
    const int damaged = rig.sink.count(Outcome::kShort) + rig.sink.count(Outcome::kForeign);
    CHECK(damaged == (before.empty() ? 0 : 1));
  }
  for (std::size_t cut = 1; cut < binary.size(); cut += 13) {  // the end of a message is lost
    AxisBytes bytes(binary.begin(), binary.end() - static_cast<std::ptrdiff_t>(cut));
    for (int i = 0; i < 2; ++i) bytes.insert(bytes.end(), binary.begin(), binary.end());
    rig.sink.clear();
    rig.feed(bytes);
    CHECK(rig.sink.count(Outcome::kOk) == (cut < 6 ? 1 : 2));
  }
}

TEST_CASE("an Axis text without an end is given up") {
  AxisRig rig;
  rig.introduce(axis_message(0, "Ann", 1));
  const AxisBytes endless = axis_text_bytes(std::string(100'000, '7'));
  const AxisBytes text = axis_bytes(axis_message(0, "Ann", 2), Form::kText);
  rig.feed(endless);
  CHECK(rig.sink.count(Outcome::kShort) == 1);
  rig.feed(text);  // its end is that of the endless one
  rig.feed(text);
  CHECK(rig.sink.count(Outcome::kShort) == 1);
  CHECK(rig.sink.count(Outcome::kOk) == 1);
}

TEST_CASE("any Axis description is refused or becomes bodies") {
  AxisRig rig;
  Message other = axis_message(1, "Ann", 1);
  AxisBytes both = axis_bytes(axis_message(0, "Ann", 1));
  const AxisBytes second = axis_bytes(other, Form::kText);
  both.insert(both.end(), second.begin(), second.end());
  rig.feed(both);
  const AxisBytes good = rig.sink.described;
  REQUIRE(good.size() == axis::kListHeadBytes + 2 * axis::kMaxEntryBytes);
  for (std::size_t size = 0; size < good.size(); ++size) {
    CHECK_FALSE(rig.driver.make_layout(std::span(good).first(size)));
  }
  const auto refused = [&](std::size_t at, unsigned value, const std::string& word) {
    AxisBytes bad = good;
    bad[at] = static_cast<std::byte>(value);
    const auto layout = rig.driver.make_layout(bad);
    REQUIRE_FALSE(layout);
    INFO(layout.error().message);
    CHECK(layout.error().message.find(word) != std::string::npos);
  };
  refused(0, 6, "order");
  refused(1, 65, "65 avatars");
  refused(1, 1, "goes on");
  refused(5, 1, "cannot be");
  refused(6, 12, "cannot be");
  refused(6, 16, "cannot be");
  refused(42, 0xFF, "RightUpLeg");
  refused(axis::kListHeadBytes + axis::kMaxEntryBytes, 0, "twice");
  std::mt19937 random(23);
  for (int round = 0; round < 500; ++round) {
    AxisBytes bad = good;
    for (int flips = 0; flips <= round % 4; ++flips) {
      bad[random() % bad.size()] = static_cast<std::byte>(random());
    }
    const auto layout = rig.driver.make_layout(bad);
    if (!layout) CHECK_FALSE(layout.error().message.empty());
  }
}

TEST_CASE("wrong options of the Axis driver are refused at once") {
  const Driver& driver = *find_driver("axis");
  test::check_refused(
      driver,
      {{{{"order", std::string("XYX")}}, "order"},
       {{{"format", std::string("json")}}, "format"},
       {{{"rate_hz", -1.0}}, "rate_hz"},
       {{{"rate_hz", 1e-9}}, "rate_hz"},
       {{{"split_bytes", std::int64_t{-1}}}, "split_bytes"},
       {{{"link", std::string("serial")}}, "link"},
       {{{"connect", std::string("nonsense")}}, "an address and a port"},
       {{{"link", std::string("udp")}, {"listen", std::string("x")}}, "an address and a port"},
       {{{"link", std::string("udp")}, {"connect", std::string("10.0.0.1:7001")}}, "connect"}});
  CHECK(driver.expect({}).value().identity == "tcp 127.0.0.1:7001");
  CHECK(driver.expect({{"link", std::string("udp")}}).value().identity == "udp 127.0.0.1:7002");
  CHECK(driver.expect({{"listen", std::string("127.0.0.1:7009")}}).value().identity ==
        "tcp 127.0.0.1:7009");
  test::check_undescribed(driver,
                          {"axis", "axis link=tcp order=YXZ", "axis link=tcp order=YXZ rate=x",
                           "axis link=tcp order=YXZ rate=-1", "axis link=tcp order=YYY rate=0",
                           "axis link=tcp order=YXZ rate=0 more=1"});
}

}  // namespace posed::drivers
