"""Draws the block diagrams of docs/concepts as SVG: `python3 docs/images/diagrams.py` from any folder.

A diagram is a list of boxes (name, column, row, lines of text, group) and of arrows between them.
"""

from pathlib import Path

WIDTH, HEIGHT, GAP_X, GAP_Y, MARGIN = 150, 66, 92, 50, 24
COLOURS = {"core": "#dbe9f6", "host": "#e6f2e0", "aux": "#fdeccf", "check": "#f3e3ef"}
STYLE = (
    "text{font:13px sans-serif;fill:#1b1f24}.small{font-size:11px;fill:#444c56}"
    "rect{stroke:#57606a;rx:6}path{fill:none;stroke:#57606a;stroke-width:1.5}"
)

LOOP = (
    [
        ("trajectory", 0, 0, ["trajectory", "p_d, b2d, derivatives"], "core"),
        ("law", 1, 0, ["controller", "law + memory"], "core"),
        ("rotors", 2, 0, ["rotors", "limits, delay, lag"], "host"),
        ("vehicle", 3, 0, ["vehicle", "(1)-(4), RK4"], "host"),
        ("disturbance", 2, 1, ["disturbance", "d1, d2"], "host"),
        ("monitors", 4, 0, ["monitors", "table of guarantees"], "check"),
    ],
    [
        ("trajectory", "law", "reference"),
        ("law", "rotors", "f, tau"),
        ("rotors", "vehicle", "applied"),
        ("disturbance", "vehicle", ""),
        ("vehicle", "law", "p, v, q, w (truth rounded to f32)"),
        ("vehicle", "monitors", "truth"),
    ],
)

CASCADE_BOXES = [
    ("force", 0, 0, ["1  force", "sig_1, sig_2, h  (16)"], "core"),
    ("attitude", 1, 0, ["2  attitude", "R_d  (22)-(24)"], "core"),
    ("rate", 2, 0, ["3  virtual rate", "mu"], "core"),
    ("torque", 3, 0, ["4  torque", "tau"], "core"),
]
CASCADE_ARROWS = [
    ("force", "attitude", "jet of alpha"),
    ("attitude", "rate", "q_d, w_d, w_d'"),
    ("rate", "torque", "mu, mu', q_e"),
]

CONTROLLER_1 = (
    CASCADE_BOXES
    + [
        ("mass", 0, 1, ["mass estimate", "beta'  (14)"], "aux"),
        ("inertia", 3, 1, ["inertia estimate", "a_hat'  (35)"], "aux"),
    ],
    CASCADE_ARROWS + [("mass", "force", "beta"), ("inertia", "torque", "a_hat")],
)

CONTROLLER_2 = (
    CASCADE_BOXES
    + [
        ("clip", 4, 0, ["saturation", "|tau_i| <= M_tau  (37)"], "core"),
        ("mass", 0, 1, ["mass estimate", "beta'  (14)"], "aux"),
        ("estimates", 3, 1, ["inertia estimates", "(51), (52)"], "aux"),
        ("auxiliary", 2, 1, ["auxiliary system", "q_a, w_a  (38), (39)"], "aux"),
    ],
    CASCADE_ARROWS
    + [
        ("torque", "clip", "tau_d"),
        ("mass", "force", "beta"),
        ("estimates", "torque", "theta_hat, Pi_hat"),
        ("auxiliary", "rate", "q_a, w_a"),
        ("auxiliary", "attitude", "R_a"),
        ("clip", "auxiliary", "tau - tau_d: the torque that saturation took"),
    ],
)


def corner(column, row):
    return MARGIN + column * (WIDTH + GAP_X), MARGIN + row * (HEIGHT + GAP_Y)


def box(column, row, lines, group):
    x, y = corner(column, row)
    first, rest = lines[0], lines[1:]
    parts = [
        f'<rect x="{x}" y="{y}" width="{WIDTH}" height="{HEIGHT}" fill="{COLOURS[group]}"/>',
        f'<text x="{x + WIDTH / 2}" y="{y + 28}" text-anchor="middle">{first}</text>',
    ]
    for i, line in enumerate(rest):
        text = line.replace("<", "&lt;")
        position = f'x="{x + WIDTH / 2}" y="{y + 47 + 14 * i}"'
        parts.append(f'<text class="small" {position} text-anchor="middle">{text}</text>')
    return "".join(parts)


def arrow(start, end, label, bottom):
    """A line between two boxes: straight within a row or column, else below all boxes."""
    (x0, y0), (x1, y1) = corner(*start), corner(*end)
    middle = WIDTH / 2
    if start[1] == end[1] and end[0] == start[0] + 1:
        y = y0 + HEIGHT / 2
        path, at = f"M{x0 + WIDTH} {y}H{x1 - 2}", (x0 + WIDTH + GAP_X / 2, y - 7)
    elif start[0] == end[0]:
        x, up = x0 + middle, y1 < y0
        ends = (y0, y1 + HEIGHT + 2) if up else (y0 + HEIGHT, y1 - 2)
        path, at = f"M{x} {ends[0]}V{ends[1]}", (x + 8, (ends[0] + ends[1]) / 2 + 4)
        return line(path, at, label, "start")
    elif end[1] < start[1]:
        x = x1 + middle
        side = x0 + WIDTH if end[0] > start[0] else x0
        path = f"M{side} {y0 + HEIGHT / 2}H{x}V{y1 + HEIGHT + 2}"
        at = (x + 8, y1 + HEIGHT + GAP_Y / 2 + 4)
        return line(path, at, label, "start")
    else:
        x_start, x_end = x0 + middle + 30, x1 + middle - (30 if end[1] == start[1] else 0)
        top = y1 + HEIGHT + 2
        path = f"M{x_start} {y0 + HEIGHT}V{bottom}H{x_end}V{top}"
        at = ((x_start + x_end) / 2, bottom + 15)
    return line(path, at, label, "middle")


def line(path, at, label, anchor):
    text = f'<text class="small" x="{at[0]}" y="{at[1]}" text-anchor="{anchor}">{label}</text>'
    return f'<path d="{path}" marker-end="url(#tip)"/>' + (text if label else "")


def draw(name, title, diagram):
    boxes, arrows = diagram
    places = {key: (column, row) for key, column, row, _, _ in boxes}
    columns = max(column for column, _ in places.values()) + 1
    rows = max(row for _, row in places.values()) + 1
    width = 2 * MARGIN + columns * WIDTH + (columns - 1) * GAP_X
    bottom = MARGIN + rows * HEIGHT + (rows - 1) * GAP_Y + 16
    lower = 0
    parts = []
    for start, end, label in arrows:
        below = bottom + 26 * lower
        place = places[start], places[end]
        if place[0][0] != place[1][0] and place[1][1] >= place[0][1] and place[1][0] != place[0][0] + 1:
            lower += 1
        parts.append(arrow(*place, label, below))
    height = bottom + 26 * lower
    parts = [box(*rest) for _, *rest in boxes] + parts
    tip = '<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="8" markerHeight="8" orient="auto">'
    tip += '<path d="M0 0L8 4L0 8z" style="fill:#57606a;stroke:none"/></marker></defs>'
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}">'
    ground = f'<rect width="{width}" height="{height}" fill="#ffffff" style="stroke:none"/>'
    text = f"{head}<title>{title}</title><style>{STYLE}</style>{tip}{ground}\n" + "\n".join(parts) + "\n</svg>\n"
    (Path(__file__).parent / name).write_text(text)


draw("loop.svg", "The control loop", LOOP)
draw("controller-1.svg", "Controller 1: cascade and estimates", CONTROLLER_1)
draw("controller-2.svg", "Controller 2: cascade, saturation, auxiliary system", CONTROLLER_2)
