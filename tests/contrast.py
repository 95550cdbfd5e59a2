"""How colours stand out from each other on a page (WCAG 2.2)."""

import re

import numpy as np


def contrast(*colours: str) -> float:
    """Ratio of the luminances of two colours, rgb(...) as browsers give them."""
    bright = []
    for colour in colours:
        value = np.array([int(v) / 255 for v in re.findall(r"\d+", colour)[:3]])
        linear = np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)
        bright.append(float(linear @ (0.2126, 0.7152, 0.0722)))
    return (max(bright) + 0.05) / (min(bright) + 0.05)


# JavaScript: texts whose contrast with their background is below 4.5 (WCAG 2.2, 1.4.3), disabled controls aside.
FAINT_TEXTS = """(() => {
    const rgb = (text) => {
        const m = text.match(/[\\d.]+/g).map(Number);
        return m.length > 3 && m[3] === 0 ? null : m;
    };
    const light = (colour) => {
        const linear = (v) => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
        const [r, g, b] = colour.slice(0, 3).map((v) => linear(v / 255));
        return 0.2126 * r + 0.7152 * g + 0.0722 * b;
    };
    const behind = (e) => {
        for (; e; e = e.parentElement) {
            const colour = rgb(getComputedStyle(e).backgroundColor);
            if (colour) return colour;
        }
        return [255, 255, 255];
    };
    const bad = [];
    const texts = "h1, h2, h3, p, a, b, li, label, th, td, button, select, input, summary, caption, figcaption, span";
    for (const e of document.querySelectorAll(texts)) {
        const own = [...e.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim());
        const off = e.matches(":disabled") || e.closest("label:has(input:disabled)") || !e.getClientRects().length;
        if (off || !(own || e.matches("input, select"))) continue;
        const [a, b] = [light(rgb(getComputedStyle(e).color)), light(behind(e))].sort((x, y) => y - x);
        const ratio = (a + 0.05) / (b + 0.05);
        if (ratio < 4.5) bad.push([e.tagName, e.id, e.textContent.slice(0, 30), ratio]);
    }
    return bad;
})()"""
