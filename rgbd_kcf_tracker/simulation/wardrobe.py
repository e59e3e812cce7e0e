# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What people wear: a random choice of clothes, and the textures made from it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rgbd_kcf_tracker.simulation import textures
from rgbd_kcf_tracker.simulation.solids import Atlas

# the textures of a person, in the order in which `Wardrobe.tailor` makes them
HEAD, HAIR, SHIRT, SLEEVE, FOREARM, HAND, THIGH, SHIN, SHOE, NECK, EXTRA = range(11)


@dataclass(frozen=True)
class Wardrobe:
    """The choice of clothes, from which the textures are made."""

    seed: int
    shirt: str
    colors: tuple[textures.Color, textures.Color, textures.Color]
    trousers: textures.Color
    trousers_kind: str
    skin: textures.Color
    hair: textures.Color
    shoes: textures.Color
    bare_arms: bool
    shorts: bool
    skirt: bool
    long_hair: bool
    hat: bool
    backpack: bool

    @classmethod
    def random(cls, rng: np.random.Generator) -> Wardrobe:
        """Everyday clothes; trousers mostly dark, shirts of any colour."""
        base = textures.random_color(rng)
        if rng.uniform() < 0.25:
            grey = rng.uniform(15, 235)
            base = (grey, grey, grey)
        jeans = rng.uniform()
        if jeans < 0.4:
            trousers = (rng.uniform(60, 120), rng.uniform(40, 80), rng.uniform(25, 60))
        elif jeans < 0.75:
            trousers = textures.random_color(rng, (0.0, 0.3), (0.06, 0.3))
        else:
            trousers = textures.random_color(rng, (0.1, 0.6), (0.2, 0.75))
        return cls(
            seed=int(rng.integers(1 << 31)),
            shirt=str(rng.choice(textures.CLOTH_KINDS)),
            colors=(base, textures.random_color(rng), textures.random_color(rng)),
            trousers=trousers,
            trousers_kind=str(rng.choice(['plain', 'plain', 'plain', 'panels', 'pinstripes'])),
            skin=textures.SKIN[int(rng.integers(len(textures.SKIN)))],
            hair=textures.HAIR[int(rng.integers(len(textures.HAIR)))],
            shoes=textures.random_color(rng, (0.0, 0.6), (0.05, 0.9)),
            bare_arms=bool(rng.uniform() < 0.45),
            shorts=bool(rng.uniform() < 0.12),
            skirt=bool(rng.uniform() < 0.12),
            long_hair=bool(rng.uniform() < 0.35),
            hat=bool(rng.uniform() < 0.12),
            backpack=bool(rng.uniform() < 0.12),
        )

    def nearly(self, rng: np.random.Generator) -> Wardrobe:
        """The same outfit on somebody else: other skin and hair, a slightly other shade."""
        shade = rng.uniform(0.9, 1.1)

        def dye(color: textures.Color) -> textures.Color:
            b, g, r = (float(min(255.0, c * shade)) for c in color)
            return b, g, r

        first, second, third = self.colors
        return replace(
            self,
            colors=(dye(first), second, third),
            trousers=dye(self.trousers),
            skin=textures.SKIN[int(rng.integers(len(textures.SKIN)))],
            hair=textures.HAIR[int(rng.integers(len(textures.HAIR)))],
            long_hair=bool(rng.uniform() < 0.35),
        )

    def tailor(self, rng: np.random.Generator) -> Atlas:
        """Textures for one wearer; what is printed on the cloth is the same for every wearer."""
        own = np.random.default_rng(self.seed)
        shirt = textures.cloth(own, 256, 512, self.shirt, self.colors)
        plain = 'plain' if self.shirt in ('logo', 'jacket', 'two_tone') else self.shirt
        sleeve = textures.cloth(own, 128, 160, plain, self.colors)
        bare = textures.skin(own, 128, 128, self.skin)
        legs = (self.trousers, self.colors[1], self.colors[2])
        thigh = textures.cloth(own, 192, 192, self.trousers_kind, legs)
        shin = textures.cloth(own, 192, 192, self.trousers_kind, legs)
        if self.shorts or self.skirt:
            shin = textures.skin(own, 192, 192, self.skin)
        dots = (self.colors[1], self.colors[2], self.trousers)
        kind = str(own.choice(['plain', 'checks', 'stripes']))
        skirt_like = textures.cloth(own, 192, 384, kind, dots)
        return Atlas([
            textures.head(rng, 192, 384, self.skin, self.hair),
            textures.hair(rng, 128, 192, self.hair),
            shirt,
            sleeve,
            bare if self.bare_arms else sleeve,
            bare,
            thigh,
            shin,
            textures.cloth(own, 64, 96, 'two_tone', (self.shoes, (225, 225, 225), self.shoes)),
            bare,
            skirt_like,
        ])  # fmt: skip
