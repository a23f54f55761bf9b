"""The type hashes (RIHS01) of the messages in an IDL file, as ROS 2 computes them: SHA-256 of the type's description
in JSON (REP-2016). Equal hashes mean that names, order and types of all members are those of ROS.

usage: type_hashes.py FILE.idl        prints a line for each @topic: package/msg/Name RIHS01_...
"""
import hashlib
import json
import re
import sys

IDS = {"long": 6, "unsigned long": 7, "double": 11, "string": 17}
NESTED, SEQUENCE = 1, 144  # a sequence's id is that of its element and 144


def ros_name(idl_name):
    package, _, _, name = idl_name.split("::")
    return f"{package}/msg/{name.rstrip('_')}"


def field(idl_type, name):
    element = re.fullmatch(r"sequence<(.+)>", idl_type)
    inner = element[1] if element else idl_type
    nested = "" if inner in IDS else ros_name(inner)
    return {"name": name, "type": {"type_id": IDS.get(inner, NESTED) + (SEQUENCE if element else 0),
                                   "capacity": 0, "string_capacity": 0, "nested_type_name": nested}}


def read(text):
    """Returns the descriptions by name, and the names of the topics' types."""
    types, topics = {}, []
    for package, body in re.findall(r"module (\w+) \{ module msg \{ module dds_ \{(.*?)\}; \}; \};", text, re.S):
        for kind, name, members in re.findall(r"@final @(\w+) struct (\w+) \{(.*?)\}", body, re.S):
            full = ros_name(f"{package}::msg::dds_::{name}")
            fields = [field(*member.strip().rsplit(None, 1)) for member in members.split(";") if member.strip()]
            types[full] = {"type_name": full, "fields": fields}
            if kind == "topic":
                topics.append(full)
    return types, topics


def type_hash(types, name):
    needed, waiting = set(), [name]
    while waiting:
        for one in types[waiting.pop()]["fields"]:
            nested = one["type"]["nested_type_name"]
            if nested and nested not in needed:
                needed.add(nested)
                waiting.append(nested)
    described = {"type_description": types[name],
                 "referenced_type_descriptions": [types[other] for other in sorted(needed)]}
    return "RIHS01_" + hashlib.sha256(json.dumps(described).encode()).hexdigest()


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        types, topics = read(re.sub(r"//.*", "", file.read()))
    for topic in topics:
        print(topic, type_hash(types, topic))


main()
