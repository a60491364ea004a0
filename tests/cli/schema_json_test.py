"""The JSON Schema of task files against the tasks of config/ and against `forereach check`.   schema_json_test.py FOREREACH"""
import copy
import json
import math
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import jsonschema
import yaml

FOREREACH = sys.argv.pop(1)
SCHEMA = json.loads(subprocess.run([FOREREACH, "keys", "--schema"], check=True, capture_output=True, text=True).stdout)
VALIDATOR = jsonschema.Draft7Validator(SCHEMA)
TASKS = sorted([*Path("config").glob("*.yaml"), *Path("config/drive").glob("*.yaml"),
                                  *Path("examples").glob("*/*.yaml"), *Path("tests/data").glob("*.yaml")])


class Loader(yaml.SafeLoader):
    """YAML 1.2, as editors and we read it: 1e-9 is a number."""


Loader.add_implicit_resolver("tag:yaml.org,2002:float", re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?$"), list("-+.0123456789"))


def load(path):
    return yaml.load(Path(path).read_text(), Loader)


def numbers(value, path=()):
    """The paths of all numbers."""
    if isinstance(value, dict):
        for key, each in value.items():
            yield from numbers(each, (*path, key))
    elif isinstance(value, list):
        for i, each in enumerate(value):
            yield from numbers(each, (*path, i))
    elif isinstance(value, (int, float)) and not isinstance(value, bool):
        yield path


def forms(schema):
    return schema.get("anyOf", [schema])


def schemas_at(schema, path):
    """The schemas of what is there, by each form that leads to it."""
    if not path:
        return forms(schema)
    found = []
    for form in forms(schema):
        key, rest = path[0], path[1:]
        if isinstance(key, int) and "items" in form:
            found += schemas_at(form["items"], rest)
        elif isinstance(key, str) and key in form.get("properties", {}):
            found += schemas_at(form["properties"][key], rest)
        elif isinstance(key, str) and isinstance(form.get("additionalProperties"), dict):
            found += schemas_at(form["additionalProperties"], rest)
    return found


def with_value(task, path, value):
    changed = copy.deepcopy(task)
    at = changed
    for key in path[:-1]:
        at = at[key]
    at[path[-1]] = value
    return changed


def neighbours(schema):
    """The numbers that are just outside a range."""
    if "minimum" in schema:
        yield math.nextafter(schema["minimum"], -math.inf)
    if "exclusiveMinimum" in schema:
        yield schema["exclusiveMinimum"]
    if "maximum" in schema:
        yield math.nextafter(schema["maximum"], math.inf)
    if "exclusiveMaximum" in schema:
        yield schema["exclusiveMaximum"]


class Schema(unittest.TestCase):
    def setUp(self):
        self.scratch = Path(self.enterContext(tempfile.TemporaryDirectory()))
        for name in ["data", "models", "policies"]:
            (self.scratch / name).symlink_to(Path("config").absolute() / name)

    def check(self, task):
        """Why our reader refuses a task of config/."""
        path = self.scratch / "task.yaml"
        path.write_text(json.dumps(task))
        command = [FOREREACH, "certify", "--config", path, "--plan", "/dev/null"]
        return subprocess.run(command, capture_output=True, text=True).stderr

    def test_is_one(self):
        jsonschema.Draft7Validator.check_schema(SCHEMA)

    def test_is_installed_and_named_by_a_new_task(self):
        task = self.scratch / "new.yaml"
        subprocess.run([FOREREACH, "init", "--model", "differential_drive", "--out", task], check=True, capture_output=True)
        named = re.match(r"# yaml-language-server: \$schema=(/.*)\n", task.read_text())
        self.assertEqual(json.loads(Path(named[1]).read_text()), SCHEMA)
        self.assertEqual(list(VALIDATOR.iter_errors(load(task))), [])

    def test_takes_every_task_of_ours(self):
        self.assertGreater(len(TASKS), 25)
        for path in TASKS:
            errors = [f"{list(error.absolute_path)}: {error.message[:200]}" for error in VALIDATOR.iter_errors(load(path))]
            self.assertEqual(errors, [], path)

    def test_refuses_what_is_just_outside_of_each_range_as_the_reader_does(self):
        seen, read = set(), 0
        for path in TASKS:
            task = load(path)
            for place in numbers(task):
                name = tuple("[]" if isinstance(key, int) else key for key in place)
                schemas = [each for each in schemas_at(SCHEMA, place) if each.get("type") in ("number", "integer")]
                if name in seen or len(schemas) != 1:
                    continue
                seen.add(name)
                for value in neighbours(schemas[0]):
                    wrong = with_value(task, place, value)
                    self.assertFalse(VALIDATOR.is_valid(wrong), f"{path} {place} {value}")
                    if path.parent == Path("config") and schemas[0]["type"] == "number":
                        read += 1
                        self.assertIn("outside", self.check(wrong), f"{path} {place} {value}")
        self.assertGreater(len(seen), 80)
        self.assertGreater(read, 60)

    def test_refuses_unknown_keys_other_forms_and_what_is_missing(self):
        task = load("config/bicycle.yaml")
        for change in [
            lambda each: each.update(speed=3),
            lambda each: each["task"].update(obstackles=[]),
            lambda each: each["task"].update(obstacles=3),
            lambda each: each["model"].update(name="boat"),
            lambda each: each["model"].update(name="point_mass"),  # wheelbase is the bicycle's alone
            lambda each: each["model"].pop("wheelbase"),
            lambda each: each.pop("domain"),
            lambda each: each["certifier"].update(zonotope_order=2.5),
            lambda each: each["certifier"].update(zonotope_order="5"),
            lambda each: each["task"].update(projection=["x", "x"]),
            lambda each: each.update(bus={"candidate": "no channel"}),
        ]:
            wrong = copy.deepcopy(task)
            change(wrong)
            self.assertFalse(VALIDATOR.is_valid(wrong), str(wrong)[:200])

    def test_says_to_each_key_what_it_means(self):
        def walk(schema, path):
            self.assertTrue(schema.get("description"), path)
            for form in forms(schema):
                for key, each in form.get("properties", {}).items():
                    walk(each, f"{path}.{key}")

        walk(SCHEMA, "")


if __name__ == "__main__":
    unittest.main()
