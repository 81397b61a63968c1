"""The classic mistakes planted in a plain tracer of their own, which shares nothing with the bank.

`made` holds the mistakes that are made. Names are short, as people's are who write such a tracer.
"""

from typing import Any

import numpy as np
import transcription


def dot(a: Any, b: Any) -> Any:
    return (a * b).sum(-1)


LAMP = np.array([500.0, 500, 500])


def crossings(s: Any, o: Any, d: Any, made: set[str], kind: str) -> list[Any]:
    p = o - s.place
    if s.normal is not None:
        n = s.normal if "rawn" not in made else np.array([float(v) for v in s.exact[3:]])
        sl = dot(d, n)
        arm = -p
        if "P1" in made:
            arm = np.broadcast_to(s.place, d.shape)
        if "P1/2" in made:
            arm = s.place - d
        t = dot(arm, n) / sl
        if "P2" in made:
            t = -t
        t = np.where(np.abs(sl) < 1e-6, np.nan, t)
        if "P4" in made:
            t = np.where(sl < 0, t, np.nan)
        if "S7" in made and kind == "s":
            t = t * np.nan
        return [t]
    r = s.radius / 2 if "I7" in made else s.radius
    a, b, c = dot(d, d), 2 * dot(p, d), dot(p, p) + (r * r if "I6" in made else -r * r)
    q = np.sqrt(b * b - 4 * a * c)
    n, f = -b - q, -b + q
    n, f = (n / 2 * a, f / 2 * a) if "I5" in made else (n / (2 * a), f / (2 * a))
    if "I3" in made:
        return [f]
    if "I4" in made:
        return [n]
    return [n, f]


def colour(sc: Any, o: Any, d: Any, depth: int, mx: int, made: set[str], bg: Any) -> Any:
    res = np.tile(np.asarray(bg, float), (len(o), 1))
    if depth > mx:
        return np.full((len(o), 3), 128.0)
    near = (1e-4 if "C9" in made else 1.0) if depth == 0 else (1.0 if "R5" in made else 1e-4)
    if "R4" in made and depth:
        near = 0.0
    best, wh = np.full(len(o), np.inf), np.full(len(o), -1)
    for i, s in enumerate(sc.surfaces):
        cand = np.full(len(o), np.inf)  # first root that counts
        for t in reversed(crossings(s, o, d, made, "c")):
            ok = (t > near) | (("C8" in made) & (depth == 0) & (s.normal is None) & (t < 0))
            cand = np.where(ok, t, cand)
        hit = np.isfinite(cand)
        if "I1" in made:
            take = hit
        elif "I2" in made:
            take = hit & (wh < 0)
        else:
            take = cand < best
        best[take], wh[take] = cand[take], i
    m = wh >= 0
    o, d, wh, t = o[m], d[m], wh[m], best[m]
    pt = o + t[:, None] * d
    sf, n = np.empty_like(pt), np.empty_like(pt)
    kd, kr = np.empty((len(wh), 1)), np.empty((len(wh), 1))
    for i, s in enumerate(sc.surfaces):
        on = wh == i
        sf[on], kd[on], kr[on] = s.colour, s.diffuse, s.reflection
        rad = s.radius / 2 if "I7" in made else s.radius
        if s.normal is None:
            n[on] = (pt[on] - s.place) / (1 if "L1" in made else rad)
        elif "P3" in made:
            v = pt[on] - s.place
            n[on] = v / np.linalg.norm(v, axis=-1, keepdims=True)
        elif "rawn" in made:
            n[on] = [float(v) for v in s.exact[3:]]
        else:
            n[on] = s.normal
    toward = LAMP - pt
    ll = np.linalg.norm(toward, axis=-1)
    cs = dot(n, toward) / ll
    if "L2" in made:
        cs = cs * ll
    if "L6" in made:
        cs = dot(n, LAMP / np.linalg.norm(LAMP))
    if "L5" in made:
        cs = -cs
    if "L4" in made:
        cs = np.abs(cs)
    elif "L3" not in made:
        cs = np.maximum(cs, 0)
    if "L7" in made:
        cs = cs * 500.0**2 / ll**2
    dk = np.zeros(len(o), bool)
    sd = toward / ll[:, None] if "S4" in made else toward
    lo, hi = 1e-4, 1.0
    if "S5" in made:
        lo = 0.05
    if "S1" in made:
        lo = 0.0
    if "S3" in made:
        hi = np.inf
    for i, s in enumerate(sc.surfaces):
        for t in crossings(s, pt, sd, made, "s"):
            if "S2" in made:
                dk |= t < 1
            else:
                dk |= (t < hi) & (t > lo) & ~(("skip" in made) & (wh == i))
    if "S6" in made:
        dk = ~dk
    if "S8" in made and depth:
        dk[:] = False
    kdd = 1.0 if "L9" in made else (kr if "L10" in made else kd)
    amb = sc.ambient * sc.ambient_coefficient * sf / (255 if "A1" in made else 256)
    if "A2" in made:
        amb = np.tile(sc.ambient * sc.ambient_coefficient, (len(sf), 1))
    if "A3" in made:
        amb = amb * kd
    dif = sf * kdd * cs[:, None]
    if "L8" in made:
        dif = dif * sc.ambient / 256
        amb = sf * sc.ambient / 256 * sc.ambient_coefficient
    dd = dk[:, None]
    loc = amb + np.where(dd, 0, dif)
    if "S9" in made:
        loc = np.where(dd, 0, amb + dif)
    if "S10" in made:
        loc = (amb + dif) * np.where(dd, 0.2, 1)
    krr = np.ones_like(kr) if "R6" in made else (kd if "L10" in made else kr)
    if "R8" in made:
        loc = loc * (1 - kr)
    mir = krr[:, 0] != 0
    if (depth < mx or "R13" in made) and mir.any():
        dn = dot(d, n)[:, None] if "R3" not in made else d * n
        r = d - 2 * dn * n
        if "R1" in made:
            r = d + 2 * dot(d, n)[:, None] * n
        if "R2" in made:
            r = -r
        r = r / np.linalg.norm(r, axis=-1, keepdims=True)
        see = colour(sc, pt[mir], r[mir], depth + 1, mx, made, bg if "R10" not in made else np.nan * np.ones(3))
        add = krr[mir] * see * (sf[mir] / 255 if "R9" in made else 1) / ((depth + 1) if "R7" in made else 1)
        if "R10" in made:
            loc[mir] = np.where(np.isnan(see), loc[mir], 0.5 * (loc[mir] + add))
        else:
            loc[mir] += add
    if "Q2" in made:
        loc = np.clip(loc, 0, 255)
    res[m] = loc
    return res


def plant(txt: str, side: int, k: str) -> Any:
    sc = transcription.read(txt)
    sc = sc._replace(surfaces=transcription._merged(sc.surfaces))
    i, j = np.meshgrid(np.arange(side), np.arange(side))
    u: Any = i + 0.5
    v: Any = j + 0.5
    if k == "C4":
        u, v = i, j + 1.0
    if k == "C6":
        v = j - 0.5
    h = 100 / side
    x, y = u * h - 50, 50 - v * h
    if k == "C5":
        e = np.linspace(-50, 50, side)
        x, y = np.meshgrid(e, e[::-1])
    if k == "C1":
        y = -y
    if k == "C2":
        x = -x
    if k == "C7":
        x, y = 2 * x, 2 * y
    d = np.stack([x, y, np.full_like(x, 100)], -1).reshape(-1, 3)
    if k == "C10":
        d /= np.linalg.norm(d, axis=-1, keepdims=True)
    made = (
        {k if k == "P1/2" else k.split("/")[0]}
        | ({"rawn"} if k == "P5" else set())
        | ({"skip"} if k in ("L3", "L4", "L5", "S9/2", "S10/2") else set())
    )
    mx = int(k[4:]) if k.startswith("R12") else 3
    bg = (40.0, 60, 90) if k == "R14" else (0.0, 0, 0)
    with np.errstate(all="ignore"):
        p = np.nan_to_num(colour(sc, np.zeros_like(d), d, 0, mx, made, bg).reshape(side, side, 3), nan=0)
    if k == "C3":
        p = p.transpose(1, 0, 2)
    if k in ("Q1", "L3"):
        p = np.floor(p).astype(np.int64).astype(np.uint8).astype(float)
    if k == "Q3":
        p = np.rint(p)
    if k == "Q4":
        p = 255 * (np.clip(p, 0, 255) / 255) ** (1 / 2.2)
    if k == "Q5":
        p = p[..., ::-1]
    if k == "Q6":
        p = p / p.max() * 255
    return p
