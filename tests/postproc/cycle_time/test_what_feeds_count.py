"""The time of a block by its F word is the one that the conversion states, by every control's rule of what F counts."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.base.options import OutputMode
from postproc.cycle_time.shape import shape
from postproc.cycle_time.source import from_conversion
from tests.postproc.kit import convert, good, setup_of, toolpath

PLATFORM = ("[part]\norigin = [0, 150, -270]\n[clearance]\nmargin = 300\n[tools.1]\ngauge_length = 80\n",
            ("RAPID", "GOTO/-10,0,40", "FEDRAT/MMPM,3000", "GOTO/-10,0,10", "GOTO/-5,1,10,0.05,0,0.99875",
             "GOTO/5,9,10,0,0,1"))
TURNS = ("[tools.1]\ngauge_length = 80\n",
         ("RAPID", "GOTO/0,0,50,0,0,1", "FEDRAT/MMPM,800", "GOTO/10,0,40,0,0,1", "GOTO/30,5,40,0.1,0,0.994987",
          "GOTO/30,5,40,0.2,0.1,0.974679", "GOTO/60,5,40,0,0,1"))
CASES = [("macro-micro", "heidenhain-tnc640", "auto", PLATFORM), ("macro-micro", "siemens-840d", "auto", PLATFORM),
         ("mikron-ucp710", "heidenhain-tnc640", "axes", TURNS), ("mikron-ucp710", "siemens-840d", "tcp", TURNS)]


@pytest.mark.parametrize(("name", "controller", "mode", "case"), CASES)
def test_blocks_take_the_time_that_their_words_state(name: str, controller: str, mode: OutputMode,
                                                     case: tuple[str, tuple[str, ...]]) -> None:
    result = good(convert(toolpath(*case[1]), name, controller, setup_of(case[0]), output=mode))
    blocks = from_conversion(result)
    assert result.feeds is not None
    seconds = (shape(blocks).length / blocks.speed)[~blocks.rapid]
    assert seconds.sum() == pytest.approx(np.nansum(result.feeds.seconds), rel=2e-3)
