$$ exp0000$ centerline data
PAINT…ÓÏõ