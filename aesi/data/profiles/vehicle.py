"""A battery-electric vehicle on a flat road: the current of one cell from the speed.

    F = m_e dv/dt + m g c_r + rho/2 c_d A v**2        force at the wheels while rolling             (1)
    P = F v / eta_drive          for F v > 0                                                        (2)
    P = max(F v eta_regen, -P_regen)   for F v < 0 and v above the regeneration limit, else 0       (3)
    I = (P + P_aux) / (N_s N_p V_nom)                 positive on discharge                         (4)

Leaves out grade, wind, gears, the inverter's map and the voltage drop of the pack: the voltage in (4) is nominal, so
that the current does not depend on the model that it is later applied to. Road-load form: Guzzella &
Sciarretta, Vehicle Propulsion Systems, 3rd ed., Springer 2013, section 2.1, doi:10.1007/978-3-642-35913-2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aesi.data.profiles.drive import Schedule
from aesi.numerics.typing import Array

GRAVITY_M_S2 = 9.81
AIR_DENSITY_KG_M3 = 1.2
"""At 20 degC and sea level."""
PACK_CAPACITY_AH = 90.0
"""Of the pack, whatever its cells: three of 30 Ah in parallel."""


@dataclass(frozen=True)
class Pack:
    """series x parallel equal cells of a nominal voltage: 31.5 kWh with cells of 30 Ah.

    `parallel` need not be whole: the pack is defined by its capacity, see `for_capacity`.
    """

    series: int = 96
    parallel: float = 3.0
    cell_nominal_v: float = 3.65

    @classmethod
    def for_capacity(cls, cell_capacity_ah: float) -> Pack:
        """The pack of the same capacity with cells of another size, so that a schedule has the same C-rates."""
        return cls(parallel=PACK_CAPACITY_AH / cell_capacity_ah)

    @property
    def volt_cells(self) -> float:
        """Watts of the pack per ampere of a cell."""
        return self.series * self.parallel * self.cell_nominal_v


@dataclass(frozen=True)
class Vehicle:
    """A compact car; the figures are round ones of its class, not of a make.

    rotating_share : inertia of wheels and rotor as a share of the mass.  regen_power_w, regen_speed_m_s : largest
    regenerative power, and the speed below which there is none.
    """

    mass_kg: float = 1800.0
    rotating_share: float = 0.05
    drag_area_m2: float = 0.65
    rolling_resistance: float = 0.010
    drive_efficiency: float = 0.88
    regen_efficiency: float = 0.70
    regen_power_w: float = 60e3
    regen_speed_m_s: float = 2.0
    auxiliaries_w: float = 500.0
    pack: Pack = Pack()

    def power_w(self, speed_m_s: Array, acceleration_m_s2: Array) -> Array:
        """(n,) W drawn from the pack, eqs. (1) to (3) and the auxiliaries; negative while charging."""
        v = speed_m_s
        inertia = self.mass_kg * (1 + self.rotating_share) * acceleration_m_s2
        rolling = self.mass_kg * GRAVITY_M_S2 * self.rolling_resistance * (v > 0)
        drag = 0.5 * AIR_DENSITY_KG_M3 * self.drag_area_m2 * v**2
        wheels = (inertia + rolling + drag) * v
        given_back = np.maximum(wheels * self.regen_efficiency, -self.regen_power_w) * (
            v >= self.regen_speed_m_s
        )
        return np.where(wheels > 0, wheels / self.drive_efficiency, given_back) + self.auxiliaries_w

    def cell_current_a(self, schedule: Schedule, dt_s: float) -> Array:
        """(n,) A, discharge positive, every dt_s from the start of the schedule to its end, eq. (4).

        The speed is linear between the rows of the schedule; the acceleration is that of its central differences.
        """
        count = round(schedule.duration_s / dt_s) + 1
        time = np.minimum(dt_s * np.arange(count), schedule.duration_s)
        speed = np.interp(time, schedule.time_s, schedule.speed_m_s)
        rates = np.gradient(schedule.speed_m_s, schedule.time_s)
        acceleration = np.interp(time, schedule.time_s, rates)
        return self.power_w(speed, acceleration) / self.pack.volt_cells
