"""Status bits of a control step."""

from enum import IntFlag


class Status(IntFlag):
    """Events of one step; no bit is set when the law was evaluated without any limit acting."""

    OUTPUT_HELD = 1 << 0
    STATE_INVALID = 1 << 1
    REFERENCE_INVALID = 1 << 2
    RESULT_INVALID = 1 << 3
    ATTITUDE_RENORMALISED = 1 << 4
    REFERENCE_CLIPPED = 1 << 5
    HEADING_HELD = 1 << 6
    TORQUE_SATURATED = 1 << 7
    MASS_PROJECTED = 1 << 8
    INERTIA_PROJECTED = 1 << 9
    SIGN_FLIPPED = 1 << 10
    AUXILIARY_CLIPPED = 1 << 11
    LASTING_PROJECTED = 1 << 12
