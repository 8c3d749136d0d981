"""The genome of a candidate: the paper's P = {Theta_s, lambda1, lambda2, tau} with p_c and d.

One gene is added: whether terms may hold the fed-back error at all. A model without feedback has no memory,
cannot diverge, and is often the better simulator; single terms alone would hardly ever switch it off.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from aesi.errors import InputError
from aesi.numerics.typing import BoolArray
from aesi.sparse.terms.library import Library

GENE_WORDS = {
    "lambda1": "ridge (lambda1)",
    "lambda2": "threshold (lambda2)",
    "tau": "least inclusion (tau)",
    "p_c": "highest order (p_c)",
    "d": "total degree (d)",
    "feedback": "feedback of the error",
}
"""Gene -> its name in reports."""


@dataclass(frozen=True)
class Genome:
    """lambda1, lambda2 : of STRidge.  tau : least inclusion probability of stability selection.

    p_c, d : highest polynomial order and total degree.  feedback : whether terms in e are admitted.
    terms : one bit a library term, packed and written as hexadecimal digits.
    """

    terms: str
    lambda1: float
    lambda2: float
    tau: float
    p_c: int
    d: int
    feedback: bool = True

    @classmethod
    def of(
        cls,
        chosen: Iterable[bool] | BoolArray,
        lambda1: float,
        lambda2: float,
        tau: float,
        p_c: int,
        d: int,
        feedback: bool = True,
    ) -> Genome:
        """A genome with the terms of a mask over the library."""
        return cls(pack(np.fromiter(chosen, dtype=bool)), lambda1, lambda2, tau, p_c, d, feedback)

    @classmethod
    def whole(
        cls,
        library: Library,
        lambda1: float,
        lambda2: float,
        tau: float = 0.5,
        p_c: int = 5,
        d: int = 5,
        feedback: bool = True,
    ) -> Genome:
        """All terms of the library within p_c and d."""
        return cls.of(np.ones(len(library), dtype=bool), lambda1, lambda2, tau, p_c, d, feedback)

    def mask(self, m: int) -> BoolArray:
        """(m,) the terms chosen. Raises InputError where the library has another size."""
        if len(self.terms) != 2 * ((m + 7) // 8):
            raise InputError(f"a genome of {len(self.terms) * 4} bits does not fit a library of {m} terms.")
        return unpack(self.terms, m)

    def active(self, library: Library) -> BoolArray:
        """(m,) the terms that enter the regression: chosen, and admitted by p_c, d and feedback."""
        return self.mask(len(library)) & library.admitted(self.p_c, self.d, self.feedback)

    def digest(self, library: Library) -> str:
        """Hash of the names of the active terms, 16 hexadecimal digits: alike for alike terms of any library."""
        names = sorted(library.take(np.flatnonzero(self.active(library))).names)
        return hashlib.sha256("\n".join(names).encode()).hexdigest()[:16]

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON values."""
        return dict(self.__dict__)

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Genome:
        """Inverse of `to_dict`."""
        return cls(**data)


def pack(mask: BoolArray) -> str:
    """A mask as hexadecimal digits."""
    return np.packbits(mask).tobytes().hex()


def unpack(digits: str, m: int) -> BoolArray:
    """Inverse of `pack`."""
    return np.unpackbits(np.frombuffer(bytes.fromhex(digits), dtype=np.uint8), count=m).astype(bool)
