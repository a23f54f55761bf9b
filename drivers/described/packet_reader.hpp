// PacketReader: reads the [[packet]] tables of a device description into a Table.
#pragma once

#include <set>
#include <string>

#include "drivers/described/table.hpp"
#include "drivers/described/toml_reader.hpp"

namespace posed::drivers::described {

class PacketReader {
 public:
  // Adds to `table`, whose link and delimiter have been read already.
  PacketReader(TomlReader& toml, Table& table) : toml_(toml), table_(table) {}

  void read_packet(const toml::table& from);

 private:
  void read_length(const toml::table& from, PacketRule& packet);
  void read_checksum(const toml::table& from, PacketRule& packet);
  void read_fields(const toml::table& from, PacketRule& packet);
  // Reads one [[packet.field]]: one value, or several consecutive ones of one kind.
  void read_field(const toml::table& from, PacketRule& packet);
  void read_range(const toml::table& from, Field& field);
  void add_field(const toml::table& from, const std::string& name, Field field, PacketRule& packet);
  void add_sensor(const toml::table& from, const std::string& name, const Field& field);
  [[nodiscard]] BitPlace place(const toml::node& blamed, std::int64_t bit, std::int64_t bits,
                               bool big, const PacketRule& packet);

  TomlReader& toml_;
  Table& table_;
  std::set<std::string> names_;
};

}  // namespace posed::drivers::described
