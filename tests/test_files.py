"""Files of the user are refused by size, nesting and digits, with the limit named."""

import gzip
import json
import os
import time
import tomllib

import pytest

from flybystab import files
from flybystab.errors import InvalidInput
from flybystab.files import csv_rows, parse_json, parse_toml, read_bytes, read_text


def test_plain_and_gzipped_text_is_read(tmp_path):
    (tmp_path / "a.csv").write_bytes(b"\xef\xbb\xbfname\n\xc3\xa9\n")
    (tmp_path / "b.gz").write_bytes(gzip.compress(b"name\n\xc3\xa9\n"))
    assert read_text(tmp_path / "a.csv", "file") == read_text(tmp_path / "b.gz", "file") == "name\né\n"


def test_a_gzip_bomb_is_refused_before_it_fills_the_memory(tmp_path):
    bomb = tmp_path / "bomb.csv.gz"
    with gzip.open(bomb, "wb", compresslevel=1) as stream:
        for _ in range(64):
            stream.write(b"0" * 2**20)
    with pytest.raises(InvalidInput, match="at most 16 MB after decompression"):
        read_bytes(bomb, "catalogue file", 16 * 2**20)
    assert len(read_bytes(bomb, "catalogue file")) == 64 * 2**20


def test_unreadable_files_are_named(tmp_path):
    os.mkfifo(tmp_path / "fifo")
    (tmp_path / "broken.gz").write_bytes(gzip.compress(b"text" * 100)[:-9])
    (tmp_path / "latin").write_bytes(b"\xe9\xff")
    for name, reason in (
        ("fifo", "ordinary file"),
        ("none", "No such file"),
        ("broken.gz", "readable"),
        ("latin", "UTF-8"),
        ("a\0b", "readable"),
        ("x" * 300, "name too long"),
        ("", "ordinary file"),
    ):
        with pytest.raises(InvalidInput, match=f"(?i){reason}"):
            read_text(tmp_path / name, "file")


def test_documents_are_refused_by_depth_digits_and_size(monkeypatch):
    deep = 100_000
    for text in ("[" * deep + "]" * deep, '{"a":' * deep + "1" + "}" * deep):
        with pytest.raises(InvalidInput, match="nested at most 100 deep"):
            parse_json(text, "file", "x")
    with pytest.raises(InvalidInput, match="nested at most 100 deep"):
        parse_toml("a = " + "[" * deep + "]" * deep, "file", "x")
    for text in ("a." * 50_000 + "b = 1", '"a".' * 200 + "b = 1", "[" + "a." * 50_000 + "b]"):
        with pytest.raises(InvalidInput, match="keys of at most 100 parts"):
            parse_toml(text, "file", "x")
    for parse, text in ((parse_json, "1" * 5000), (parse_toml, "a = " + "1" * 5000)):
        with pytest.raises(InvalidInput, match="at most 1,000 digits"):
            parse(text, "file", "x")
    for parse in (parse_json, parse_toml):
        with pytest.raises(InvalidInput, match=r"JSON document|valid TOML"):
            parse("{nonsense", "file", "x")
    monkeypatch.setattr(files, "DOCUMENT_LIMIT", 2**20)
    with pytest.raises(InvalidInput, match="at most 1 MB"):
        parse_json(" " * 2**21, "file", "x")


def test_the_check_of_a_long_word_takes_linear_time():
    begin = time.process_time()
    with pytest.raises(InvalidInput, match="valid TOML"):
        parse_toml("a" * 2**20 + "\n" + "a " * 2**19, "file", "x")
    assert time.process_time() - begin < 10.0


def test_brackets_and_digits_inside_strings_do_not_count():
    value = {"a": "[" * 500 + "9" * 2000, "b": ['"\\', {"c": 1}]}
    assert parse_json(json.dumps(value), "file", "x") == value
    text = 'a = "' + "[" * 500 + "9" * 2000 + "\"\nb = '''[[\n'''\nc.d = [[1], [2]] # ]]\n"
    assert parse_toml(text, "file", "x") == tomllib.loads(text)


def test_long_cells_are_refused():
    assert list(csv_rows('a,"b\nc"\n', "file", "x")) == [["a", "b\nc"]]
    with pytest.raises(InvalidInput, match="cells of at most 131,072 characters"):
        list(csv_rows("a," + "x" * 140_000, "file", "x"))
