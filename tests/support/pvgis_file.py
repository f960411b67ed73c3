"""Files as PVGIS gives them."""

from datetime import date

import numpy as np
import pandas as pd

from reluctance.pumping.weather_file import WeatherTable, clear_sky


def pvgis_file(path, place, *, tmy, slope=0, minute=10):
    """A file of PVGIS, written from a clear year by the hour, UTC: its light is that of an instant
    in each hour. A typical year has months of two years and full hours, and tells the minute in its
    head; where the light is that of the middle of an hour it does not."""
    t = pd.date_range("2019-01-01", "2020-01-01", freq="h", inclusive="left", tz="UTC")
    table = WeatherTable(kind="clear", start=date(2019, 1, 1))
    sky = clear_sky(t + pd.Timedelta(minutes=minute), 3600.0, place, table)
    years = np.where(t.month % 2, 2019, 2015)
    stamps = [f"{y}{when:%m%d:%H}00" for y, when in zip(years, t, strict=True)]
    if tmy:
        names = "time(UTC),T2m,RH,G(h),Gb(n),Gd(h),IR(h),WS10m,WD10m,SP"
        rows = [
            f"{s},28,30,{g:.2f},{b:.2f},{d:.2f},300,2,0,980"
            for s, g, b, d in zip(stamps, sky.ghi, sky.dni, sky.dhi, strict=True)
        ]
    else:
        names = "time,Gb(i),Gd(i),Gr(i),H_sun,T2m,WS10m,Int"
        stamps = [f"{when:%Y%m%d:%H}{minute}" for when in t]
        rows = [
            f"{s},{g - d:.2f},{d:.2f},0.0,0,28,2,0"
            for s, g, d in zip(stamps, sky.ghi, sky.dhi, strict=True)
        ]
    head = (
        f"Latitude (decimal degrees): {place.latitude_deg:.3f}\n"
        f"Longitude (decimal degrees): {place.longitude_deg:.3f}\n"
        f"Elevation (m): {place.altitude_m:g}\n"
    )
    if tmy and minute != 30:
        head += f"Irradiance Time Offset (h): {minute / 60:.4f}\n"
    head += "" if tmy else f"Slope: {slope} deg. \nAzimuth: 0 deg. \n"
    path.write_text(head + "\n" + names + "\n" + "\n".join(rows) + "\n\nT2m: air\n")
    return sky
