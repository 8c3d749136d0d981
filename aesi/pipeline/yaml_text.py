"""YAML of which nothing is lost: a key that is there twice is refused, and what is wrong is told by line and column."""

from __future__ import annotations

from typing import Any

import yaml


class _UniqueKeys(yaml.SafeLoader):
    """PyYAML takes the last of several values of one key, against the standard (YAML 1.2, 3.2.1.3)."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        seen: set[tuple[str, str]] = set()
        for key, _ in node.value:
            if not isinstance(key, yaml.ScalarNode):
                continue
            if (key.tag, key.value) in seen:
                said = f"the key {key.value!r} is there twice; keep one"
                raise yaml.MarkedYAMLError(problem=said, problem_mark=key.start_mark)
            seen.add((key.tag, key.value))
        return super().construct_mapping(node, deep)


def parse_yaml(text: str) -> Any:
    """Plain values of a YAML text.  Raises ValueError that says where it is not YAML."""
    try:
        return yaml.load(text, _UniqueKeys)
    except yaml.MarkedYAMLError as error:
        mark, said = error.problem_mark, ", ".join(filter(None, (error.context, error.problem)))
        place = "" if mark is None else f" at line {mark.line + 1}, column {mark.column + 1}"
        raise ValueError(f"is not YAML{place}: {' '.join(said.split())}.") from None
    except yaml.reader.ReaderError as error:
        raise ValueError(f"is not YAML: character {error.position + 1}: {error.reason}.") from None
    except (ValueError, AttributeError) as error:  # a date or a number that is none
        # Of a number of thousands of digits Python advises programmers, too.
        said, _, _ = str(error).partition("; use sys.")
        raise ValueError(f"is not YAML: {said}.") from None
    except RecursionError:
        raise ValueError("is not YAML of an experiment: its lists or keys are nested too deeply.") from None
