"""Asks the program, once for each recording, binary and set of options."""

import hashlib
import json
import os
import pathlib
import subprocess
import time
from concurrent.futures import ThreadPoolExecutor

LIMIT_S = 300


def digest(path):
    """Of a file's bytes."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


class Program:
    def __init__(self, path, cache, jobs):
        self.path, self.cache, self.jobs = os.path.abspath(path), pathlib.Path(cache), jobs
        self.cache.mkdir(parents=True, exist_ok=True)
        self.digest = digest(path)
        self.files = {}

    def knows(self, option):
        """Whether `diagnose` has an option."""
        return option in subprocess.run([self.path, "diagnose", "--help"], capture_output=True, text=True).stdout

    def answer(self, arguments, folder):
        """What the program says, as {"result", "error", "seconds"}; options that name files are relative to the folder."""
        key = hashlib.sha256(self.digest.encode())
        for argument in arguments:
            path = pathlib.Path(folder) / argument
            if path.is_file():
                if path not in self.files:
                    self.files[path] = digest(path)
                key.update(self.files[path].encode())
            key.update(argument.encode() + b"\0")
        kept = self.cache / f"{key.hexdigest()}.json"
        if kept.exists():
            return json.loads(kept.read_text())
        began = time.monotonic()
        try:
            done = subprocess.run([self.path, *arguments, "--json", "-", "--quiet"], cwd=folder, capture_output=True, text=True, timeout=LIMIT_S)
            found = {"result": json.loads(done.stdout) if done.returncode in (0, 1) else None, "error": done.stderr.strip() if done.returncode not in (0, 1) else None}
        except subprocess.TimeoutExpired:
            found = {"result": None, "error": f"no answer within {LIMIT_S} s"}
        except json.JSONDecodeError as error:
            found = {"result": None, "error": f"no JSON: {error}"}
        found["seconds"] = round(time.monotonic() - began, 3)
        part = kept.with_suffix(f".{os.getpid()}.{id(found)}")
        part.write_text(json.dumps(found))
        part.rename(kept)
        return found

    def answers(self, requests, said=lambda done, all: None):
        """Answers to (arguments, folder), several at a time, in their order."""
        out = []
        with ThreadPoolExecutor(self.jobs) as pool:
            for found in pool.map(lambda request: self.answer(*request), requests):
                out.append(found)
                said(len(out), len(requests))
        return out


def diagnose(truth):
    """Options that put a question to `ndof diagnose`."""
    baseline = ["--baseline", truth["baseline"]] if truth["baseline"] else []
    return ["diagnose", *truth["files"], *truth["arguments"], *baseline, "--threads", "1"]
