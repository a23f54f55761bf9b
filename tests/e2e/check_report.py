#!/usr/bin/env python3
"""Checks the page that `posed ... --report` has written: an XML parser reads it, it loads nothing, no
attribute is no number, every axis has a unit. Prints its words, one text a line.

usage: check_report.py PAGE.html"""
import re
import sys
import xml.etree.ElementTree as xml

text = open(sys.argv[1], encoding="utf-8").read()
page = xml.fromstring(text.split("\n", 1)[1])  # behind the document type
for element in page.iter():
    for name, value in element.attrib.items():
        if name in ("src", "href", "srcset", "data", "action"):
            sys.exit(f"<{element.tag}> loads {value}")
        if element.tag != "svg" and name != "content" and re.search(r"\b(nan|inf)\b", value):
            sys.exit(f"<{element.tag} {name}> is {value}")
if re.search(r"https?://|url\(|@import|<script", text):
    sys.exit("the page names something outside")
for chart in page.iter("svg"):
    if not chart.get("aria-label"):
        sys.exit("a figure has no words")
for figure in page.iter("figure"):
    if not "".join(figure.find("p").itertext()).strip().endswith("."):
        sys.exit("a figure has no sentence")
for element in page.iter():
    for words in (element.text, element.tail):
        if words and words.strip() and element.tag != "style":
            print(words.strip())
