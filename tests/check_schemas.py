#!/usr/bin/env python3
"""check_schemas.py FILE.json: validates specs by their JSON schemas, as the Python package jsonschema understands them.

FILE has {"schemas": {KIND: SCHEMA}, "values": [[KIND, VALUE], ...]}. Prints the errors of each value as one JSON list;
exits with 77 if jsonschema is not installed.
"""
import json
import sys

try:
    from jsonschema import Draft202012Validator
except ImportError as missing:
    print(missing, file=sys.stderr)
    sys.exit(77)

with open(sys.argv[1]) as file:
    specs = json.load(file)
validators = {}
for kind, schema in specs["schemas"].items():
    Draft202012Validator.check_schema(schema)
    validators[kind] = Draft202012Validator(schema)
errors = [[error.message for error in validators[kind].iter_errors(value)] for kind, value in specs["values"]]
json.dump(errors, sys.stdout)
