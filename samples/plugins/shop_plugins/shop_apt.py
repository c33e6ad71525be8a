"""A CL dialect: APT text of a post of the shop, which has words of its own for what APT has others for."""

from toolpaths.cl.systems.shop_forms import ShopDialect

SHOP_APT = ShopDialect(
    like="generic",
    marks=("SHOP POST",),
    words={"MOVETO": "GOTO", "FAST": "RAPID", "SPEED": "SPINDL", "FEED": "FEDRAT"},
    passive=("OPERATOR", "SHIFT"))
