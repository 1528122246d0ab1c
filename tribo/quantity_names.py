"""The names that quantities have in the exports of machines, in the languages of their programs.

Names are plain: without case, accents, units or punctuation (:func:`tribo.quantities.plain_name`). Where several
columns of an export fit a quantity, the name that stands first here is preferred.
"""

ALIASES = {
    "time": """
        time
        test time
        step time
        elapsed time
        timestamp
        time stamp
        total time
        run time
        running time
        zeit
        prufzeit
        laufzeit
        versuchszeit
        temps
        temps d essai
        duree
        t
        test zeit
        temps ecoule
        tiempo
        tempo
        tijd
        total elapsed time
        cycle elapsed time
        czas
        czas testu
        aika
        tid
        cas
        ido
        zaman
        sure
        timp
        время
        час
        χρονος
        时间
        试验时间
        時間
        試験時間
        経過時間
        시간
    """,
    "friction force": """
        friction force
        friction
        tangential force
        traction force
        frictionforce
        lateral force
        reibkraft
        reibungskraft
        force de frottement
        load
        force
        standard force
        standardkraft
        prufkraft
        kraft
        force standard
        fx
        ff
        ft
        f
        load cell
        axial force
        traction force 1
        effort
        last
        tangential load
        tangentialkraft
        force tangentielle
        horizontal force
        pull force
        pulling force
        tensile force
        sled force
        fuerza de friccion
        forza di attrito
        fuerza
        forza
        forca
        kracht
        carga
        force x
        fx force
        daq fx
        tensile load
        zugkraft
        charge
        sila tarcia
        sila
        sila styczna
        kitkavoima
        voima
        friktionskraft
        friktion
        wrijvingskracht
        treci sila
        sila treni
        surtunme kuvveti
        kuvvet
        forta de frecare
        forta
        forca de atrito
        forca de friccao
        tangencialni sila
        сила трения
        сила
        усилие
        τριβη
        摩擦力
        obciazenie
        нагрузка
        力
        负荷
        切向力
        载荷
        試験力
        摩擦荷重
        荷重
        마찰력
        하중
        힘
    """,
    "displacement": """
        extension
        displacement
        stroke
        crosshead
        crosshead position
        position
        standard travel
        standardweg
        course standard
        weg
        hub
        course
        deplacement
        axial displacement
        traverse
        course traverse
        traverse abs
        traverse absolue
        maschine
        maschinenweg
        machine displacement
        linear position
        sliding distance
        distance
        x position
        x
        dx
        tensile extension
        tensile displacement
        crosshead displacement
        crosshead travel
        axial extension
        grip to grip separation
        absolute crosshead travel
        crosshead absolute
        actuator displacement
        sled displacement
        travel
        desplazamiento
        spostamento
        deslocamento
        verplaatsing
        extension en traction
        disp
        displ
        xyz x position
        droga
        przemieszczenie
        wydluzenie
        droga tarcia
        siirtyma
        matka
        forskjutning
        forflyttning
        stracka
        weglange
        draha
        posun
        posuv
        elmozdulas
        yer degistirme
        deplasare
        recorrido
        corsa
        percorso
        curso
        перемещение
        путь
        ход
        位移
        行程
        変位
        ストローク
        移動距離
        변위
    """,
    "normal force": """
        normal force
        normal load
        vertical force
        normal force fz
        ball load
        contact force
        normalkraft
        force normale
        fz
        fn
        fz force
        daq fz
        nominal load
        force z
        carga normal
        forza normale
        fuerza normal
        sila normalna
        obciazenie normalne
        sila nacisku
        normaalivoima
        normaalkracht
        normalova sila
        pritlacna sila
        normal kuvvet
        forta normala
        forca normal
        нормальная сила
        нормальная нагрузка
        法向力
        正压力
        法向载荷
        垂直力
        垂直荷重
        法線力
        押付力
        수직하중
        수직력
    """,
    "friction coefficient": """
        cof
        friction coefficient
        coefficient of friction
        traction coeff
        daq cof
        mu
        reibwert
        coefficient de frottement
        reibungskoeffizient
        reibzahl
        reibungszahl
        coefficiente di attrito
        coeficiente de friccion
        cof mu
        wspolczynnik tarcia
        kitkakerroin
        friktionskoefficient
        wrijvingscoefficient
        koeficient treni
        surtunme katsayisi
        coeficient de frecare
        coeficiente de atrito
        coeficiente de rozamiento
        coefficient de friction
        коэффициент трения
        摩擦系数
        摩擦係数
        마찰계수
    """,
    "torque": """
        friction torque
        torque
        frictional torque
        friction moment
        reibmoment
        drehmoment
        moment
        couple
        couple de frottement
        moment de frottement
        coppia
        momento
        par
        koppel
        moment tarcia
        moment sily
        момент
        момент трения
        扭矩
        摩擦力矩
        トルク
        摩擦トルク
        토크
    """,
    "temperature": """
        temperature
        temp
        temperatur
        ambient temperature
        room temperature
        raumtemperatur
        temperature c
        temperatura
        temperature ambiante
        lampotila
        teplota
        sicaklik
        температура
        温度
        온도
    """,
    "humidity": """
        humidity
        relative humidity
        rh
        feuchte
        luftfeuchte
        humidite
        luftfeuchtigkeit
        relative luftfeuchte
        wilgotnosc
        humedad
        umidita
        humidade
        vochtigheid
        kosteus
        luftfuktighet
        vlhkost
        nem
        влажность
        湿度
        습도
    """,
    "speed": """
        sliding velocity
        sliding speed
        speed
        velocity
        geschwindigkeit
        gleitgeschwindigkeit
        vitesse
        vitesse de glissement
        gleitgeschw
        predkosc
        predkosc poslizgu
        velocidad
        velocita
        velocidade
        snelheid
        nopeus
        hastighet
        rychlost
        hiz
        viteza
        скорость
        скорость скольжения
        速度
        滑动速度
        すべり速度
        속도
    """,
    "rotation speed": """
        rotation speed
        rotational speed
        rotary speed
        spindle speed
        rotational velocity
        rotation rate
        revolution speed
        rpm
        drehzahl
        vitesse de rotation
        velocidad de giro
        velocita di rotazione
        toerental
        转速
        回転数
        회전수
    """,
}
