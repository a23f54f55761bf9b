// PacketReader: reads the [[packet]] tables of a device description into a Table.
#pragma once

#include <array>
#include <set>
#include <string>

#include "drivers/described/table.hpp"
#include "proto/text/toml_table.hpp"

namespace posed::drivers::described {

class PacketReader {
 public:
  // Adds to `table`, whose link and delimiter have been read already. After an error it may leave
  // the rest of a packet unread: only one is reported.
  PacketReader(Findings& findings, Table& table) : findings_(findings), table_(table) {}

  void read_packet(TableReader& from);

 private:
  // One [[packet.field]]: one value, or several consecutive ones of one kind.
  struct FieldGroup {
    Field field;                            // without its place and index
    std::array<double, 2> value{0.0, 1.0};  // of a sensor, at the ends of its range
    std::string unit = "1";                 // of a sensor or an extra
    double tick_s = 0.0;                    // of a time
  };

  void read_length(TableReader& from, PacketRule& packet);
  void read_checksum(TableReader& from, PacketRule& packet);
  void read_field(TableReader& from, PacketRule& packet);
  void read_range(TableReader& from, int bits, Field& field);
  void read_meaning(TableReader& from, FieldGroup& group);
  void add_field(TableReader& from, const std::string& name, FieldGroup group, PacketRule& packet);
  void add_sensor(TableReader& from, const std::string& name, const FieldGroup& group);
  [[nodiscard]] BitPlace place(TableReader& from, int bit, int bits, bool big,
                               const PacketRule& packet);
  [[nodiscard]] bool good() const { return findings_.errors.empty(); }

  Findings& findings_;
  Table& table_;
  std::set<std::string> names_;
};

}  // namespace posed::drivers::described
