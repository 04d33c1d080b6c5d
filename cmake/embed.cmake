# Assets of the pages are embedded here (apps/report).
