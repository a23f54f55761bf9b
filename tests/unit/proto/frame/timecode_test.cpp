#include "proto/frame/timecode.hpp"

#include <catch2/catch.hpp>

#include <string>

namespace posed {

TEST_CASE("a timecode keeps the two forms that there are") {
  for (const char* text : {"01:02:03:04", "23:59:59:29", "10:20:30.405", "00:00:00:00"}) {
    CHECK(view_of(to_timecode(text)) == text);
  }
  CHECK(view_of(Timecode{}).empty());
}

TEST_CASE("a text of another form is no timecode") {
  for (const char* text :
       {"", "1:02:03:04", "01:02:03", "01:02:03:04:05", "01:02:03:4", "01:02:03.04", "01:02:03:004",
        "01-02-03-04", "aa:bb:cc:dd", "01:02:03;04", " 01:02:03:04", "01:02:03:04 "}) {
    INFO(text);
    CHECK(view_of(to_timecode(text)).empty());
  }
  CHECK(view_of(to_timecode(std::string(1000, '0'))).empty());
}

TEST_CASE("a timecode in a number has hours, minutes, seconds and frames, a byte each") {
  CHECK(view_of(to_timecode(0x01020304U)) == "01:02:03:04");
  CHECK(view_of(to_timecode(23U << 24 | 59U << 16 | 59U << 8 | 99U)) == "23:59:59:99");
  CHECK(view_of(to_timecode(1U)) == "00:00:00:01");
  CHECK(view_of(to_timecode(0U)).empty());  // devices without a timecode send that
  for (const std::uint32_t packed : {24U << 24, 60U << 16, 60U << 8, 100U, 0xFFFFFFFFU}) {
    CHECK(view_of(to_timecode(packed)).empty());
  }
}

}  // namespace posed
